"""Logs and files to values and back."""
