"""What can be wrong with labelled photos, and is told by file and field."""
