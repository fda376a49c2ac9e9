"""Layouts of rings as evenly placed as the paper's."""

import numpy as np

from ..coverage.rings import Ring, Setup
from ..objectives.scene import Scene


def ring_layout(scene: Scene, rings_per_link: int, sensors_per_ring: int) -> Setup:
    """Rings as evenly placed as the paper's, without tilt, on every link with a length; one ring on each other link."""
    rings = []
    for mount in scene.robot.mounts:
        n = rings_per_link if mount.length > 0 else 1
        low, high = scene.limits_of(mount.link).position
        places = np.linspace(low, high, n) if n > 1 else [(low + high) / 2 if mount.length > 0 else 0.0]
        rings += [Ring(mount.link, float(p), sensors_per_ring, 0.0, 0.0, scene.radius_of(mount.link), scene.sensor) for p in places]
    return Setup(tuple(rings))
