"""Model files and rows of variants."""
