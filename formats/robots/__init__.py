"""Import of robots: URDF, meshes, and the capsules and mounts fitted to them."""
