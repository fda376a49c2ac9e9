"""What sensors cover: solids, robots, sensors, the octree count, the soft estimate."""
