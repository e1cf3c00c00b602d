"""The next measurement: what would tell the remaining candidates apart."""
