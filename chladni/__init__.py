"""A virtual Fourier analyser for acceleration logs."""

__version__ = "0.1.0"
