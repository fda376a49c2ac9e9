"""The choices that a user makes by name, in scenes, files and options. Importing them loads nothing
else.
"""

from typing import Literal

Rule = Literal["centre", "touch", "certified"]
"""How a voxel is counted: by its centre, where any part of it is inside, or by a guaranteed
interval."""

Law = Literal["uniform", "normal"]
"""How mounting errors are distributed: ``uniform`` up to their limits, or ``normal`` with half of
these as standard deviations."""

Losing = Literal["ring", "sensor"]
"""What fails: the ring, or the sensor, whose loss costs most."""

Along = Literal["x", "y", "z"]
"""The axis of a frame along which its sensor looks."""

Surface = Literal["collision", "visual"]
"""Which meshes of a URDF stand for a link."""

SENSOR_FRAMES = "tof_.*"
"""A regular expression for the names of frames that are sensors."""
