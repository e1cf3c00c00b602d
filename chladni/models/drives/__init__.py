"""Drives and the magnetorheological damper."""
