"""Constraints of real mounts and of a scene's rules."""
