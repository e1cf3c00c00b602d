"""Simulated systems whose answer is known."""
