"""Studies of many measurements, on one process or a cluster."""
