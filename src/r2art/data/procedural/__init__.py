"""What procedural objects are made of: solids, textures, draws of an rng."""
