"""Modes from frequency responses or from responses alone, their validation, and what they say about a structure."""
