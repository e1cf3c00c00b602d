"""Modes from responses alone."""
