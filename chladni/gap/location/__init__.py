"""Which site the missing force, motion or distortion acts at, without assuming a law."""
