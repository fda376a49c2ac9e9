"""Sensors, those that can be bought, their ranges and boards."""
