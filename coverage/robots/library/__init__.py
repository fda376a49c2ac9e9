"""Definitions of the built-in robots."""
