"""What is mounted as sensors, in lists, JSON and frames of a URDF, as rings again."""
