"""Elementary transfer functions and corrections."""
