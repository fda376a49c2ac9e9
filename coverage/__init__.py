"""The geometry of coverage: solids, robots, sensors, octree count, soft estimator."""
