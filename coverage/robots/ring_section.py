"""What a ring around a link surrounds: the link's tube about the mount axis."""

import numpy as np
from jaxtyping import Float

from .robot import Body, Mount

# cosine: a body of a mount's frame within 30 degrees of its axis is the tube that rings go around
_ALONG = 0.866
_PLACES = 65  # along a body's axis


def tube_of(mount: Mount, bodies: tuple[Body, ...]) -> list[Body]:
    """The bodies of a mount's own link that its rings go around: on its frame, along its axis; no
    housing across it.
    """
    found = []
    for body in bodies:
        along = body.capsule.end - body.capsule.start
        length = float(np.linalg.norm(along))
        if body.frame == mount.frame and length > 0 and abs(along @ mount.axis) > _ALONG * length:
            found.append(body)
    return found


def axes_of(mount: Mount) -> Float[np.ndarray, "3 3"]:
    """Rows: the mount's axis, zero and side, in the frame of its link."""
    return np.stack([mount.axis, mount.zero, mount.side])


def surrounded(mount: Mount, bodies: tuple[Body, ...]) -> float:
    """The radius about the mount axis, m, of what a ring goes around: the section, as far aside as
    it stands, and the tubes that stand for it, in the middle of the usable stretch."""
    at, found = sum(mount.usable) / 2 * mount.length, mount.aside + mount.section
    for body in tube_of(mount, bodies):
        ends = (np.stack([body.capsule.start, body.capsule.end]) - mount.start) @ axes_of(mount).T
        places = ends[0] + np.linspace(0, 1, _PLACES)[:, None] * (ends[1] - ends[0])
        ahead, off = np.abs(places[:, 0] - at), np.hypot(places[:, 1], places[:, 2])
        radius = body.capsule.radius
        reach = off + np.sqrt(np.maximum(radius**2 - ahead**2, 0.0))
        found = max(found, float(np.max(reach, where=ahead < radius, initial=0.0)))
    return found
