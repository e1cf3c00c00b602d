"""Best parameters within their tolerances, by output error."""
