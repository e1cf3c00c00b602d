"""The catalogue of unmodelled effects: one a file."""
