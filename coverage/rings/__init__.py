"""Rings of sensors and setups of rings, one by one and as arrays."""
