"""Robots: chains, links with their bodies and mounts, and the volumes around them."""
