"""Moving people and objects, minimum distances, detection in time, and the twin in MuJoCo."""
