"""Pictures of a scene: a small ray tracer on NVIDIA Warp, and what a camera does to them."""
