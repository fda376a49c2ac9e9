"""Pareto fronts of two targets."""
