"""Definitions: classes that state their fields, units, limits and help once, for all doors."""
