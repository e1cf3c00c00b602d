"""Studies on disk: recipes, tables of results, and the logs that are fetched for them."""
