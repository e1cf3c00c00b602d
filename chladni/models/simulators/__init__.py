"""Simulators that aren't ours, with the catalogue's effects wrapped around them."""
