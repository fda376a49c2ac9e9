"""Moving people and objects, minimum distances, and detection in time."""
