"""Poses of a robot that are clear of itself and of the cell, and the routes between them."""
