"""Violations of real mounts: rings that are too narrow, that cannot be closed around the link, or
that lie in a body, an obstacle or another ring.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.occlusion.circle_clearance import circle
from ...coverage.rings.ring import Ring
from ...coverage.robots.ring_section import axes_of
from .clearance import MountClearance

REAL = ("mount", "standoff")  # keys of the rules that this module checks
_ROUNDING = 1e-6  # m of a radius, as files round it
_PLACE = 1e-8  # of a link: positions are rounded to the safe side
_POINTS = 72  # points on a ring that are tested against another ring
_MANY = 256  # poses at once


@dataclass(frozen=True)
class Standing:
    """A violation of a real mount."""

    rings: tuple[int, ...]
    """Indices of the rings concerned."""
    rule: str
    """Key of the rule in a scene file."""
    text: str
    """One-line message."""


def standing(clear: MountClearance, rings: Sequence[Ring]) -> list[Standing]:
    """Return all mount violations of ``rings`` except their spacing on one link."""
    violations = [f for i, ring in enumerate(rings) for f in alone(clear, i, ring)]
    return violations + meeting(clear, rings)


def alone(clear: MountClearance, i: int, ring: Ring) -> list[Standing]:
    """Return the mount violations of ring ``i`` by itself."""
    name, least, violations = f"ring {i} ({ring.link})", clear.scene.least_radius(ring.link), []
    if ring.radius < least - _ROUNDING:
        text = (
            f"{name} has a radius of {1000 * ring.radius:.1f} mm, allowed: {1000 * least:.1f} mm"
            " or more"
        )
        violations.append(Standing((i,), "standoff", text))
    low, high = clear.closed(ring.link)
    if low > high:
        violations.append(Standing((i,), "mount", f"{name}: {clear.why(ring.link, ring.radius)}"))
    elif (
        not low - _PLACE <= ring.position <= high + _PLACE
        and clear.scene.robot.mount(ring.link).length > 0
    ):
        text = (
            f"{name} sits at {ring.position:.3f}, a ring can be closed from {low:.3f} to {high:.3f}"
        )
        violations.append(Standing((i,), "mount", text))
    if within := clear.within(ring.link, ring.radius, ring.position):
        violations.append(
            Standing((i,), "mount", f"{name} at {ring.position:.3f} lies in {', '.join(within)}")
        )
    return violations


def meeting(clear: MountClearance, rings: Sequence[Ring]) -> list[Standing]:
    """Return the violations of rings on different links that intersect at some pose.

    The test samples points of one ring. Every reported intersection is real, but an overlap of a
    few millimetres may be missed.
    """
    violations = []
    for (i, a), (j, b) in itertools.combinations(enumerate(rings), 2):
        if a.link != b.link:
            poses = np.flatnonzero(_between(clear, a, b) < clear.scene.rules.band[0])
            if len(poses):
                text = f"ring {i} ({a.link}) lies in ring {j} ({b.link}) at pose {poses[0]}"
                violations.append(Standing((i, j), "mount", text))
    return violations


def _between(clear: MountClearance, one: Ring, other: Ring) -> Float[np.ndarray, " P"]:
    """Return the distance between two rings at each pose, m, measured between their mid-surfaces.

    Points of one ring are tested against the other.
    """
    robot, arm = clear.scene.robot, clear.scene.rules.arm
    mount, against = robot.mount(one.link), robot.mount(other.link)
    places = one.position * mount.length + np.array([-arm, 0.0, arm])
    points = circle(places, one.radius, _POINTS).reshape(-1, 3) @ axes_of(mount) + mount.start
    distances = []
    for first in range(0, len(clear.frames), _MANY):
        frames = clear.frames[first : first + _MANY]
        T = np.linalg.inv(frames[:, against.frame]) @ frames[:, mount.frame]
        seen = np.einsum("pij,nj->pni", T[:, :3, :3], points) + T[:, None, :3, 3] - against.start
        v = seen @ axes_of(against).T
        ahead = np.maximum(np.abs(v[..., 0] - other.position * against.length) - arm, 0.0)
        off = np.hypot(v[..., 1], v[..., 2]) - other.radius
        distances.append(np.hypot(ahead, off).min(axis=1))
    return np.concatenate(distances)
