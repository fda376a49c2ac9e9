"""Robots: chains, links with their bodies and mounts, and the volumes about them."""
