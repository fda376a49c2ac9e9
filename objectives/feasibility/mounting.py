"""Violations of real mounts: rings that are too narrow, that cannot be closed around the link, or
that lie in a body, an obstacle or another ring.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from ...coverage.rings.envelope_clearance import least_distance, surface_points
from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_envelope import Envelope
from ...coverage.robots.ring_section import axes_of
from .clearance import MountClearance
from .ring_envelopes import envelope

REAL = ("mount", "standoff")  # keys of the rules that this module checks
_ROUNDING = 1e-6  # m of a radius, as files round it
_PLACE = 1e-8  # of a link: positions are rounded to the safe side
# m, spacings of the points at which a ring is compared with another one; the second only where the
# first leaves it open
_SPACINGS = (0.016, 0.004)


@dataclass(frozen=True)
class Fault:
    """A violated rule."""

    rings: tuple[int, ...]
    """Indices of the rings concerned, from 0."""
    rule: str
    """Key of the rule in a scene file."""
    text: str
    """One-line message."""


def standing(clear: MountClearance, rings: Sequence[Ring]) -> list[Fault]:
    """Return all mount violations of ``rings`` except their spacing on one link."""
    violations = [f for i, ring in enumerate(rings) for f in alone(clear, i, ring)]
    return violations + meeting(clear, rings)


def alone(clear: MountClearance, i: int, ring: Ring) -> list[Fault]:
    """Return the mount violations of ring ``i`` by itself."""
    name, least, violations = f"ring {i} ({ring.link})", clear.scene.least_radius(ring.link), []
    if ring.radius < least - _ROUNDING:
        text = (
            f"{name} has a radius of {1000 * ring.radius:.1f} mm, allowed: {1000 * least:.1f} mm"
            " or more"
        )
        violations.append(Fault((i,), "standoff", text))
    low, high = clear.closed(ring)
    if low > high:
        violations.append(Fault((i,), "mount", f"{name}: {clear.why(ring.link, ring.radius)}"))
    elif (
        not low - _PLACE <= ring.position <= high + _PLACE
        and clear.scene.robot.mount(ring.link).length > 0
    ):
        text = (
            f"{name} sits at {ring.position:.3f}, a ring can be closed from {low:.3f} to {high:.3f}"
        )
        violations.append(Fault((i,), "mount", text))
    if within := clear.within(ring):
        text = f"{name} at {ring.position:.3f} lies in or too near to {', '.join(within)}"
        violations.append(Fault((i,), "mount", text))
    return violations


def meeting(clear: MountClearance, rings: Sequence[Ring]) -> list[Fault]:
    """Return the violations of rings on different links that come too near to each other at some
    pose.

    Rings whose distance exceeds the clearance by 4 mm or more are never reported, rings that are
    too near always.
    """
    violations = []
    envelopes = [envelope(clear.scene, ring) for ring in rings]
    for (i, j), poses in _close(clear, rings, envelopes).items():
        poses = _near(clear, rings[i], rings[j], (envelopes[i], envelopes[j]), poses)
        if len(poses):
            text = (
                f"ring {i} ({rings[i].link}) lies in or too near to ring {j} ({rings[j].link}) at"
                f" pose {poses[0]}"
            )
            violations.append(Fault((i, j), "mount", text))
    return violations


def _close(
    clear: MountClearance, rings: Sequence[Ring], envelopes: Sequence[Envelope]
) -> dict[tuple[int, int], Int[np.ndarray, " P"]]:
    """Return the pairs of rings on different links whose balls come too near to each other, with
    the poses at which they do.

    Each ring lies in a ball about the middle of its circle of lenses. One ring is compared with all
    others at once, so that memory grows with rings and not with pairs of rings.
    """
    mounts = [clear.scene.robot.mount(ring.link) for ring in rings]
    middles = np.array(
        [
            clear.frames[:, m.frame, :3, :3] @ (m.start + r.position * m.length * m.axis)
            + clear.frames[:, m.frame, :3, 3]
            for r, m in zip(rings, mounts, strict=True)
        ]
    ).reshape(len(rings), len(clear.frames), 3)  # (R, P, 3), base frame
    reach = np.array([math.hypot(max(-e.low, e.high), e.outer) for e in envelopes])
    links = np.array([ring.link for ring in rings])
    close = {}
    for i in range(len(rings)):
        others = i + 1 + np.flatnonzero(links[i + 1 :] != links[i])
        least = reach[others] + reach[i] + clear.scene.rules.clearance
        near = np.linalg.norm(middles[others] - middles[i], axis=2) < least[:, None]  # (N, P)
        for k in np.flatnonzero(near.any(axis=1)):
            close[i, int(others[k])] = np.flatnonzero(near[k])
    return close


def _near(
    clear: MountClearance,
    one: Ring,
    other: Ring,
    envelopes: tuple[Envelope, Envelope],
    poses: Int[np.ndarray, " P"],
) -> Int[np.ndarray, " N"]:
    """Return at which of the ``poses`` two rings are not proven to keep the clearance.

    A point on the outside of one ring is within the spacing of a sampled one.
    """
    here, there = envelopes
    mount, against = (clear.scene.robot.mount(ring.link) for ring in (one, other))
    at = other.position * against.length
    T = np.linalg.inv(clear.frames[poses, against.frame]) @ clear.frames[poses, mount.frame]
    middle = mount.start + one.position * mount.length * mount.axis
    kept = np.arange(len(poses))
    for spacing in _SPACINGS:
        points = surface_points(here, spacing) @ axes_of(mount) + middle
        seen = ((points @ T[k, :3, :3].T + T[k, :3, 3] - against.start) for k in kept)
        distance = least_distance(there, (v @ axes_of(against).T for v in seen), at)
        kept = kept[np.array(distance) < clear.scene.rules.clearance + spacing]
    return poses[kept]
