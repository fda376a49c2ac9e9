"""ζ against the side of the voxels."""
