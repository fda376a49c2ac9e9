"""Fronts of two targets."""
