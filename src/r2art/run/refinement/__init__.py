"""Estimates moved until they fit a mask. NumPy alone; see docs/silhouettes.md."""
