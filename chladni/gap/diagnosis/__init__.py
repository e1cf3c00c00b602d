"""The whole diagnosis: compare, tune, locate, explain, measure the closing."""
