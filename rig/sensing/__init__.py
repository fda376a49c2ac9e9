"""Readings of sensors, their noise, and the readings expected of mounted rings."""
