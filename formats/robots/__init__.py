"""A robot's URDF, its meshes, and capsules and mounts fitted to them."""
