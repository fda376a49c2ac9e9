"""Evenly spaced ring layouts, as in the paper."""

import numpy as np

from ...coverage.rings.ring import Ring, Setup
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.scene import CoreScene


def ring_layout(scene: CoreScene, rings_per_link: int, sensors_per_ring: int) -> Setup:
    """Return a layout with evenly spaced rings without tilt.

    Every link with a length carries ``rings_per_link`` rings, each other link one. Fixed rings take
    these places where a link has no others: on a link without a length, and where the rules'
    largest number of rings on a link leaves fewer. Where rings have bodies, a link on which no
    position is clear at all poses carries none, unless no link has a clear position.
    """
    clear, rings = MountClearance(scene) if scene.real else None, []
    radii = {
        link: clear.radius(link) if clear else scene.radius_of(link) for link in scene.robot.links
    }
    free = {
        link for link, radius in radii.items() if clear is None or clear.stretches(link, radius)
    }
    for mount in scene.robot.mounts:
        if free and mount.link not in free:
            continue
        n, most = (rings_per_link, scene.rules.max_rings_per_link) if mount.length > 0 else (1, 1)
        if fixed := sum(ring.link == mount.link for ring in scene.rules.fixed):
            n = max(min(n, most - fixed), 0)
        low, high = scene.limits_of(mount.link).position
        places = (
            np.linspace(low, high, n)
            if n > 1
            else [(low + high) / 2 if mount.length > 0 else 0.0] * n
        )
        sensor = scene.sensor_of(mount.link)
        rings += [
            Ring(mount.link, float(p), sensors_per_ring, 0.0, 0.0, radii[mount.link], sensor)
            for p in places
        ]
    return Setup(tuple(rings))
