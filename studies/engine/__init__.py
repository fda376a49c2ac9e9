"""What runs a study: its tasks, the cells that are finished, one process or a cluster."""
