"""The virtual instruments: one a system, free of any framework."""
