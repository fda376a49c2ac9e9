"""Readers of the triangles in mesh files, within limits that hold before any work."""
