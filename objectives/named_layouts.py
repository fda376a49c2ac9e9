"""The paper's layouts in a scene: where their rings sit if they are to be mounted there."""

from dataclasses import replace

from ..coverage.rings.ring import Ring, Setup, named_setup
from .feasibility.ring_envelopes import closable, envelope
from .scene import CoreScene


def layout_in(scene: CoreScene, name: str) -> Setup:
    """Return the layout of a name such as ``n2_16_25`` in a scene.

    Without bodies it is the paper's own: on the lines between the joints, at the scene's radius.
    Real rings keep links, relative positions, counts and tilts. They sit on the mounts' axes, with
    0 and 1 at the first and last position at which they can be closed, and with the radius that
    their boards need.

    Raises:
        ValueError: if the name is not one of a layout.
    """
    setup = named_setup(name, scene.sensor, scene.ring_radius)
    if not scene.real:
        return setup
    links = scene.robot.links
    return Setup(tuple(_mounted(scene, r) if r.link in links else r for r in setup.rings))


def _mounted(scene: CoreScene, ring: Ring) -> Ring:
    mount = scene.robot.mount(ring.link)
    ring = replace(ring, radius=scene.radius_of(ring.link))
    if mount.length == 0:
        return ring
    low, high = closable(mount, envelope(scene, ring))
    place = low + ring.position * (high - low) if low <= high else sum(mount.usable) / 2
    return replace(ring, position=min(max(place, 0.0), 1.0))
