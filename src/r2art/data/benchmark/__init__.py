"""The benchmark: datasets from fixed seeds, made by one command and held by a manifest."""
