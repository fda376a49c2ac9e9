"""Rings of sensors and setups of rings, as objects and as arrays."""
