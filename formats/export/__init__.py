"""Setups for other programs."""
