"""Withheld cases: machines whose hidden effects are sealed, made by what knows none of the catalogue's laws."""
