"""Occlusion of beams by the robot's bodies and the cell's obstacles."""
