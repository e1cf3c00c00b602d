"""Signals that drive a simulation."""
