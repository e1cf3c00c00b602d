"""What a model does: time and frequency characteristics, roots, influence, best values."""
