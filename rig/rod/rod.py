"""A test rod: where it can stand, and whether the rings see it there.

The rod is a capsule upright in the base frame. A sensor tells of it where it returns the rod, and
nearer than what it returns without the rod by more than readings scatter. A rod is seen though its
middle lies beside every beam: what is predicted here is for the rod, not for a point.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.occlusion.ball_in_cone import ball_in_cone
from ...coverage.rings.ring import Setup
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.cones import cone
from ...coverage.solids.segments import segment_to_segment
from ...objectives.scene import Scene
from ..poses.clear import from_cell
from ..sensing.expected import beams_at, expected, in_beams, only
from ..sensing.noise import Noise

CLEAR = 0.03  # m that a rod keeps from robot and cell


@dataclass(frozen=True)
class Rod:
    """radius: m. length: m, of the axis between the middles of the round ends."""

    radius: float = 0.035
    length: float = 0.3

    def at(self, points: Float[np.ndarray, "N 3"]) -> Capsules:
        """The rod upright with its middle at each of N points, as the only capsule of N poses."""
        half = np.array([0.0, 0.0, self.length / 2])
        return Capsules((points - half)[:, None], (points + half)[:, None], np.array([self.radius]))


@dataclass(frozen=True)
class Detection:
    """When a sensor counts as seeing the rod: its median of ``frames`` readings is nearer than its
    median of ``before`` readings without the rod by ``sure`` standard deviations of their
    difference; or there was nothing before."""

    noise: Noise = field(default_factory=Noise)
    frames: int = 10
    before: int = 20
    sure: float = 5.0

    def margin(self, distance: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """By how much nearer (...) m than ``distance`` (...) m, which was read before."""
        return (
            self.sure
            * math.sqrt(math.pi / 2 * (1 / self.frames + 1 / self.before))
            * self.noise.at(distance)
        )


def placeable(
    scene: Scene,
    q: Float[np.ndarray, " J"],
    points: Float[np.ndarray, "N 3"],
    rod: Rod,
    clear: float = CLEAR,
) -> Bool[np.ndarray, " N"]:
    """Where the rod can stand at pose ``q`` (J,) rad: ``clear`` m off the robot and the
    obstacles.
    """
    stands = rod.at(points)
    good = np.asarray((from_cell(scene, stands) >= clear).all(axis=1))
    if scene.robot.bodies:
        start, end, radius = robot_capsules(scene.robot, forward(scene.robot.chain, q)).arrays()
        for a, b, r in zip(start, end, radius, strict=True):
            a, b = (np.broadcast_to(v, points.shape) for v in (a, b))
            good &= (
                segment_to_segment(stands.start[:, 0], stands.end[:, 0], a, b) - r - rod.radius
                >= clear
            )
    return good


def seen(
    scene: Scene,
    setup: Setup,
    q: Float[np.ndarray, " J"],
    points: Float[np.ndarray, "N 3"],
    rod: Rod,
    detection: Detection,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> Bool[np.ndarray, " N"]:
    """Is the rod told by any sensor, at each of N points, at pose ``q`` (J,) rad? ``alive``:
    sensors that answer; None: all.

    The ball in the rod's middle settles most points; the others are asked for the whole rod.
    """
    beams, before = beams_at(scene, setup, q[None]), expected(scene, setup, q[None]).distance[0]
    limit = np.where(
        np.isfinite(before),
        before - detection.margin(np.where(np.isfinite(before), before, 0.0)),
        np.inf,
    )
    found, pairs = np.zeros(len(points), bool), []
    reach, around, square = rod.length / 2 + rod.radius, beams.around(), beams.is_square()
    for k in np.flatnonzero(np.ones(len(beams), bool) if alive is None else alive):
        left = np.flatnonzero(~found)
        cosine, sine = np.cos(around.half_angle[k]), np.sin(around.half_angle[k])
        off = cone(
            points[left],
            np.asarray(around.apex[k]),
            around.axis[k],
            cosine,
            sine,
            around.range_m[k],
        )
        near = left[off <= reach]
        if not square[k]:
            one = (beams.apex[k], beams.axis[k], beams.half_angle[k], beams.range_m[k])
            found[near] = ball_in_cone(*one, points[near], np.array(rod.radius))[0] < limit[k]
        near = near[~found[near]]
        pairs.append(np.stack([np.full(len(near), k), near]))
    if pairs:
        k, n = np.concatenate(pairs, axis=1)
        k, n = k[~found[n]], n[~found[n]]
        upright = rod.at(points[n])
        distance = in_beams(
            only(beams, k),
            np.asarray(upright.start[:, 0]),
            np.asarray(upright.end[:, 0]),
            np.full(len(n), rod.radius),
        )
        found[n[distance < limit[k]]] = True
    return found
