"""Logs that are still being written, servers and instruments: samples as they come."""
