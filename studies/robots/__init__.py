"""Cost of ignoring the robot's body, for several robots."""
