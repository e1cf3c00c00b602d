"""What is done with frequency responses before, or beside, a fit."""
