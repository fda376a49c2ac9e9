"""Engine of the studies: tasks, finished cells, and execution on one process or a cluster."""
