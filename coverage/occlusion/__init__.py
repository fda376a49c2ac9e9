"""What sensors see past the robot's bodies and the cell's obstacles."""
