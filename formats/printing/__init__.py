"""Rings to print."""
