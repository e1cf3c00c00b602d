"""Values of the diagnosis: what was measured, what was found."""
