"""The cross section that a ring surrounds: the link's tube about the mount axis."""

import numpy as np
from jaxtyping import Float

from .robot import Body, Mount

# cosine: a body within 30 degrees of its mount's axis counts as the tube that rings surround
_ALONG = 0.866
_PLACES = 65  # sample points along a body's axis


def tube_of(mount: Mount, bodies: tuple[Body, ...]) -> list[Body]:
    """Return the bodies of a mount's own link that its rings surround.

    They lie on the mount's frame and along its axis; housings across it are excluded.
    """
    tubes = []
    for body in bodies:
        along = body.capsule.end - body.capsule.start
        length = float(np.linalg.norm(along))
        if body.frame == mount.frame and length > 0 and abs(along @ mount.axis) > _ALONG * length:
            tubes.append(body)
    return tubes


def axes_of(mount: Mount) -> Float[np.ndarray, "3 3"]:
    """Return the mount's axis, zero and side as rows, in the frame of its link."""
    return np.stack([mount.axis, mount.zero, mount.side])


def surrounded(mount: Mount, bodies: tuple[Body, ...]) -> float:
    """Return the radius about the mount axis, m, that a ring must surround.

    It covers the measured section, including its offset from the axis, and the capsules of the
    tube, at the middle of the usable interval.
    """
    at, outermost = sum(mount.usable) / 2 * mount.length, mount.aside + mount.section
    for body in tube_of(mount, bodies):
        ends = (np.stack([body.capsule.start, body.capsule.end]) - mount.start) @ axes_of(mount).T
        places = ends[0] + np.linspace(0, 1, _PLACES)[:, None] * (ends[1] - ends[0])
        ahead, off = np.abs(places[:, 0] - at), np.hypot(places[:, 1], places[:, 2])
        radius = body.capsule.radius
        reach = off + np.sqrt(np.maximum(radius**2 - ahead**2, 0.0))
        outermost = max(outermost, float(np.max(reach, where=ahead < radius, initial=0.0)))
    return outermost
