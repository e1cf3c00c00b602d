"""What a command does, composed of the floors below."""
