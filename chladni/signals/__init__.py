"""Value records, units and errors; the floor that imports nothing of ours."""
