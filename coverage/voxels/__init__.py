"""The octree: which voxels a solid holds, exactly or between guaranteed bounds."""
