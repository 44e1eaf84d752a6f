"""Models that users have (URDF, MJCF, PartNet-Mobility), read as objects of a category.

A reader (`urdf`, `mjcf`, `partnet`) turns a file into a `model.Model`; `build` turns that into an
`r2art.data.shape.Instance`; `imported` makes a category of one or many of them.
"""
