"""Studies: one recipe over many logs, on all cores or on a cluster."""
