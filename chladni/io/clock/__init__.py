"""Clocks: what the stamps of messages say of when their samples were taken."""
