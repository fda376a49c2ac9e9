"""People and objects that move, minimum distances, detection in time."""
