"""The octree: the voxels of a solid, exactly or between guaranteed bounds."""
