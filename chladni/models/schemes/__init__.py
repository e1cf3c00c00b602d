"""Block schemes with any number of loops."""
