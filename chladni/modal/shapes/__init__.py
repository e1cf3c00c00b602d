"""What modal vectors say: comparison, complexity, validation, relative motion."""
