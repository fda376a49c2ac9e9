"""Zeta against the side of the voxels."""
