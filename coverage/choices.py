"""Choices that scenes, files and options make by name. This module imports nothing else."""

from typing import Literal

Rule = Literal["sampled", "centre", "touch", "certified"]
"""How voxels are counted: ``sampled`` counts those of which a drawn point is inside, ``centre``
those whose centre is inside, ``touch`` those of which any part is inside; ``certified`` computes a
guaranteed interval instead."""

Law = Literal["uniform", "normal"]
"""Distribution of mounting errors: ``uniform`` up to the limits, or ``normal`` with half the limits
as standard deviations."""

Losing = Literal["ring", "sensor"]
"""What fails: the ring or the sensor whose loss costs most coverage."""

Along = Literal["x", "y", "z"]
"""The axis of a sensor frame along which the sensor looks."""

Surface = Literal["collision", "visual"]
"""Which meshes of a URDF define a link's shape."""

Bus = Literal["auto", "direct", "multiplexer", "own"]
"""How the sensors of a ring are connected: ``direct``, each XSHUT on a pin; ``multiplexer``, each
sensor on a channel; ``auto``, direct where the bus bears it; ``own``, with the user's own means."""

Disturbance = Literal["direct", "overlap", "reflection"]
"""Ways in which the light of a sensor reaches another, from the strictest to all: ``direct`` on its
window, ``overlap`` of their beams, ``reflection`` on a body of the scene."""

Faults = Literal["random", "turned", "late", "none"]
"""What a simulated rig is given: ``random`` errors and faults; a cell that is ``turned`` by 180°
about z of the base, as one read from a pendant by mistake; one ring that fires in slots ``late``,
out of step with the others; or ``none``."""

BaseFrame = Literal["base_link", "pendant"]
"""Frame of coordinates in the base frame of an arm of Universal Robots: ``base_link`` of its ROS
description, or the feature Base of its pendant."""

SENSOR_FRAMES = "tof_.*"
"""Regular expression that matches the names of sensor frames."""
