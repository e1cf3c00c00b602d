"""Poles of models of rising order, and the choice among them."""
