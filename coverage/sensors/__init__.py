"""Sensors: the catalogue of commercial models, their ranges and their boards."""
