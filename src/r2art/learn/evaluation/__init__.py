"""How wrong predictions are: measures, tables, pictures."""
