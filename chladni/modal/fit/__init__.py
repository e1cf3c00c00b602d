"""The modal model: shapes by least squares, everything by greatest likelihood, with error bars."""
