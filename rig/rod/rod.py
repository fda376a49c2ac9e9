"""Test rod: where it can stand, and whether the rings see it there.

The rod is an upright capsule in the base frame. A sensor detects it if it reads the rod, and if
that reading is closer than the reading without the rod by more than the noise. A rod can be seen
although its centre is outside every beam: predictions here are for the rod, not for a point.
"""

import math
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Metres
from ...coverage.occlusion.ball_in_cone import ball_in_cone
from ...coverage.rings.ring import Setup
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.cones import around
from ...coverage.solids.segments import segment_to_segment
from ...objectives.scene import Scene
from ...simulation.twin.noise import Noise
from ...simulation.twin.zone_grid import zoned
from ..poses.clear import from_cell
from ..sensing.expected import beams_at, expected, in_beams, only
from ..sensing.zone_targets import expected_zones, zones_of_rods

CLEAR = 0.03  # m between a rod and robot or cell


@definition
class Rod:
    """A test rod."""

    radius: Metres = 0.035
    """m."""
    length: Annotated[float, Field(ge=0, le=10)] = 0.3
    """Length of the axis between the centres of the round ends, m."""

    def at(self, points: Float[np.ndarray, "N 3"]) -> Capsules:
        """Return the upright rod with its centre at each of N points, as the only capsule of N
        poses.
        """
        half = np.array([0.0, 0.0, self.length / 2])
        return Capsules((points - half)[:, None], (points + half)[:, None], np.array([self.radius]))


_Frames = Annotated[int, Field(ge=1, le=100_000)]


@definition
class RodCriterion:
    """Rule by which a sensor detects the rod: its median with the rod is closer than its median
    without the rod by ``sure`` standard deviations of their difference, or there was no target
    before.
    """

    noise: Noise = Noise()
    """Noise of the sensors."""
    frames: _Frames = 10
    """Readings with the rod."""
    before: _Frames = 20
    """Readings without the rod."""
    sure: Annotated[float, Field(gt=0, le=100)] = 5.0
    """Required difference, in standard deviations."""

    def margin(self, distance: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Return how much closer (...) m than the previous reading ``distance`` (...) m a reading
        must be.
        """
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
) -> Bool[np.ndarray, " N"]:
    """Return where the rod can stand at pose ``q`` (J,) rad: ``CLEAR`` m away from the robot and
    the obstacles.
    """
    stands = rod.at(points)
    good = np.asarray((from_cell(scene, stands) >= CLEAR).all(axis=1))
    if scene.robot.bodies:
        robot = scene.robot.enclosed()
        start, end, radius = robot_capsules(robot, forward(robot.chain, q)).arrays()
        for a, b, r in zip(start, end, radius, strict=True):
            a, b = (np.broadcast_to(v, points.shape) for v in (a, b))
            good &= (
                segment_to_segment(stands.start[:, 0], stands.end[:, 0], a, b) - r - rod.radius
                >= CLEAR
            )
    return good


def seen(
    scene: Scene,
    setup: Setup,
    q: Float[np.ndarray, " J"],
    points: Float[np.ndarray, "N 3"],
    rod: Rod,
    detection: RodCriterion,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> Bool[np.ndarray, " N"]:
    """Return whether any sensor detects the rod at each of N points at pose ``q`` (J,) rad.

    ``alive`` selects the sensors that answer; None means all. The ball in the rod's centre settles
    most points; the others are tested with the whole rod. A zone sees the rod although another zone
    sees something nearer.
    """
    beams, before = beams_at(scene, setup, q[None]), expected(scene, setup, q[None]).distance[0]
    limit = np.where(
        np.isfinite(before),
        before - detection.margin(np.where(np.isfinite(before), before, 0.0)),
        np.inf,
    )
    found, pairs = np.zeros(len(points), bool), []
    reach, cones, rays = rod.length / 2 + rod.radius, around(beams), beams.by_rays()
    for k in np.flatnonzero(np.ones(len(beams), bool) if alive is None else alive):
        left = np.flatnonzero(~found)
        off = cones.part(points[left], int(k))
        near = left[off <= reach]
        if not rays[k]:
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
        inside = np.isfinite(distance) & ~found[n]
        _by_zone(scene, setup, q, rod.at(points), (k[inside], n[inside]), detection, found)
    return found


def _by_zone(
    scene: Scene,
    setup: Setup,
    q: Float[np.ndarray, " J"],
    rods: Capsules,
    pairs: tuple[Int[np.ndarray, " p"], Int[np.ndarray, " p"]],
    detection: RodCriterion,
    found: Bool[np.ndarray, " N"],
) -> None:
    """Mark in ``found`` the rods that a zone sees, of pairs of a sensor and a rod in its beam."""
    of = setup.ring_of_sensor
    for ring in zoned(setup):
        before = expected_zones(scene, setup, ring, q[None])[0, ..., 0]
        there = np.isfinite(before)
        margin = detection.margin(np.where(there, before, 0.0))
        limit = np.where(there, before - margin, np.inf)
        first = setup.slices[ring].start
        for k in np.unique(pairs[0][of[pairs[0]] == ring]):
            some = pairs[1][pairs[0] == k]
            some = some[~found[some]]
            one = Capsules(rods.start[some], rods.end[some], rods.radius)
            read = zones_of_rods(scene, setup, ring, int(k) - first, q, one)
            found[some[(read < limit[k - first]).any(axis=(1, 2))]] = True
