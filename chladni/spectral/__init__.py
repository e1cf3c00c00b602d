"""Averaged spectra and everything derived from them; knows no file and no viewer."""
