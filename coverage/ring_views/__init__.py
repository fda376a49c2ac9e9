"""What the sensors of a ring see of points, at many places of the ring at once."""
