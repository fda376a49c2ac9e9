"""The paper's layouts in a scene, and like ones: where their rings sit if they are to be mounted
there."""

from dataclasses import replace

import numpy as np

from ..coverage.rings.ring import Ring, Setup, named_setup
from .feasibility.clearance import MountClearance
from .feasibility.ring_envelopes import closable, envelope
from .scene import Scene


def layout_in(scene: Scene, name: str) -> Setup:
    """Return the layout of a name such as ``n2_16_25`` in a scene.

    Without bodies it is the paper's own: on the lines between the joints, at the scene's radius.
    Real rings keep links, relative positions, counts and tilts. They sit on the mounts' axes, with
    0 and 1 at the first and last position at which they can be closed, and with the radius that
    their boards need.

    Raises:
        ValueError: if the name is not one of a layout.
    """
    setup = named_setup(name, scene.sensor, scene.default_radius)
    if not scene.real:
        return setup
    links = scene.robot.links
    return Setup(tuple(_mounted(scene, r) if r.link in links else r for r in setup.rings))


def _mounted(scene: Scene, ring: Ring) -> Ring:
    mount = scene.robot.mount(ring.link)
    ring = replace(ring, radius=scene.radius_of(ring.link))
    if mount.length == 0:
        return ring
    low, high = closable(mount, envelope(scene, ring))
    place = low + ring.position * (high - low) if low <= high else sum(mount.usable) / 2
    return replace(ring, position=min(max(place, 0.0), 1.0))


def ring_radii(scene: Scene, clear: MountClearance | None) -> dict[str, float]:
    """Return the radius of a new ring on each link, m.

    Args:
        scene: the scene.
        clear: its mount clearance; None where rings have no bodies.
    """
    links = scene.robot.links
    return {link: clear.radius(link) if clear else scene.radius_of(link) for link in links}


def ring_layout(scene: Scene, rings_per_link: int, sensors_per_ring: int) -> Setup:
    """Return a layout with evenly spaced rings without tilt.

    Every link with a length carries ``rings_per_link`` rings, each other link one. Fixed rings take
    these places where a link has no others: on a link without a length, and where the rules'
    largest number of rings on a link leaves fewer. Where rings have bodies, a link on which no
    position is clear at all poses carries none, unless no link has a clear position.
    """
    clear, rings = MountClearance(scene) if scene.real else None, []
    radii = ring_radii(scene, clear)
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
