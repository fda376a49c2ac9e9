"""Studies of many measurements, on one process or many."""
