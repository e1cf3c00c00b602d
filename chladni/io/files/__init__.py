"""Data files of other tools to time series and back."""
