"""Block schemes with any number of loops: the signal at every point, in time and in frequency."""
