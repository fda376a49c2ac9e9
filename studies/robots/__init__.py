"""What ignoring the robot's body costs, robot by robot."""
