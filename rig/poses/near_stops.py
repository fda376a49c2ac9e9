"""Near stops: the distance below which a reading of each sensor stops the robot, for each pose of a
path.

A sensor that may see the robot's own body would stop the robot needlessly. Only where that can
happen, its near stop is lowered to below the distance of that body. Where the body may touch the
sensor there is no near stop.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.capsules import Capsules
from ...objectives.scene import Scene
from ..sensing.expected import beams_at, to_capsules

STEP = np.radians(4.0)  # rad between the poses of a path
MARGIN = 0.05  # m that a sensor may read too little: 20 mm of offset, and scatter
_SLIP = 0.02  # m; a ring may sit this far elsewhere along its link
_ASTRAY = np.radians(8.0)  # rad; a sensor may point this far elsewhere than proposed
_WIDEST = np.radians(170.0)
NOBODY = -1


@dataclass(frozen=True)
class NearStops:
    """Near stops of K sensors, as wired, at P poses of paths."""

    full: float
    """Full distance that the scene requests, m."""
    joints: Float[np.ndarray, "P J"]
    """Poses, rad."""
    least: Float[np.ndarray, "P K"]
    """A reading below this distance stops the robot, m; at 0 no reading does."""
    body: Int[np.ndarray, "P K"]
    """Number of the robot's body that lowers the near stop; ``NOBODY`` where it is not lowered."""

    @property
    def share(self) -> float:
        """Share of the sensors that keep the full distance, averaged over all poses."""
        return float((self.least >= self.full).mean()) if self.least.size else 1.0

    def lowered(self, by: float) -> "NearStops":
        """Return the near stops, each shortened by ``by`` m."""
        return replace(self, least=np.maximum(self.least - by, 0.0))

    def wired_anyhow(self, setup: Setup) -> "NearStops":
        """Near stops that hold in whatever order each ring's sensors are wired: for all sensors of
        a ring those of the lowest.
        """
        least, body = self.least.copy(), self.body.copy()
        for k in setup.slices:
            lowest = self.least[:, k].argmin(axis=1)[:, None]  # (P, 1)
            for whole, own in ((least, self.least), (body, self.body)):
                whole[:, k] = np.take_along_axis(own[:, k], lowest, axis=1)
        return replace(self, least=least, body=body)

    def near(self, q: Float[np.ndarray, " J"], within: float) -> Float[np.ndarray, " K"]:
        """Return the near stops (K,) m at ``q`` (J,) rad: the lowest of the poses within ``within``
        rad in every joint, or the full distance if there are none.
        """
        here = np.abs(self.joints - q).max(axis=1) <= within  # (P,)
        least: np.ndarray = self.least[here].min(axis=0, initial=self.full)
        return least


def joined(*stops: NearStops) -> NearStops:
    """Combine the near stops of the same sensors along several paths."""
    parts = (
        np.concatenate([getattr(s, key) for s in stops]) for key in ("joints", "least", "body")
    )
    return NearStops(stops[0].full, *parts)


def near_stops(scene: Scene, setup: Setup, joints: Float[np.ndarray, "P J"]) -> NearStops:
    """Return the near stops of all sensors at P poses (P, J) rad.

    Each ring may sit up to 2 cm elsewhere along its link. Each sensor may point up to 8° elsewhere
    than proposed, and read up to 5 cm too little. Single sensors stand where they are proposed.
    Unless the scene says that the rings are as proposed, each ring may also be wired in reverse or
    mounted the other way round.
    """
    full, shape = scene.motion.near, (len(joints), setup.sensors)
    if not scene.robot.bodies or not len(joints):
        return NearStops(full, joints, np.full(shape, full), np.full(shape, NOBODY))
    wide = setup.with_sensors(_wider)
    tilts = (1,) if scene.motion.rings_as_proposed else (1, -1)
    distance, body = np.full(shape, np.inf), np.full(shape, NOBODY)
    for slip, way in product((0.0, -_SLIP, _SLIP), tilts):
        rings = tuple(replace(_slipped(scene, r, slip), tilt=way * r.tilt) for r in wide.rings)
        there = replace(wide, rings=rings)
        distance, body = _nearer(distance, body, *_to_robot(scene, there, joints, full + MARGIN))
    if not scene.motion.rings_as_proposed:
        mirror = _in_reverse(setup)
        distance, body = _nearer(distance, body, distance[:, mirror], body[:, mirror])
    least = np.clip(distance - MARGIN, 0.0, full)
    return NearStops(full, joints, least, np.where(least < full, body, NOBODY))


def _to_robot(
    scene: Scene, setup: Setup, joints: Float[np.ndarray, "P J"], most: float
) -> tuple[Float[np.ndarray, "P K"], Int[np.ndarray, "P K"]]:
    """Return the distance (P, K) m of the nearest of the robot's bodies in each beam, and that
    body's number; bodies ``most`` m away or farther may be omitted.
    """
    # (P, B, 3), (B,)
    robot = scene.robot.enclosed()
    start, end, radius = robot_capsules(robot, forward(robot.chain, joints)).arrays()
    beams, of = beams_at(scene, setup, joints), np.repeat(np.arange(len(joints)), setup.sensors)
    shape, within = (len(joints), setup.sensors), np.full(len(beams), most)
    found, body = np.full(shape, np.inf), np.full(shape, NOBODY)
    for b in range(len(radius)):
        one = Capsules(start[:, b : b + 1], end[:, b : b + 1], radius[b : b + 1])
        distance = to_capsules(beams, of, one, within).reshape(shape)
        found, body = _nearer(found, body, distance, np.full(shape, b))
    return found, body


def _nearer(
    distance: np.ndarray, body: np.ndarray, other: np.ndarray, its: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the smaller of two distances, with its body."""
    less = other < distance
    return np.where(less, other, distance), np.where(less, its, body)


def _in_reverse(setup: Setup) -> Int[np.ndarray, " K"]:
    """Return for each sensor the sensor (K,) that takes its place if the rings are wired in
    reverse.
    """
    rings = zip(setup.groups, setup.slices, strict=True)
    return np.concatenate([k.start + -np.arange(g.count) % g.count for g, k in rings])


def _slipped(scene: Scene, ring: Ring, by: float) -> Ring:
    """Return the ring moved by ``by`` m along its link, if the link has a length."""
    length = scene.robot.mount(ring.link).length
    return replace(ring, position=ring.position + by / length) if length > 0 else ring


def _wider(sensor: Sensor) -> Sensor:
    return sensor.with_angles(lambda angle: min(angle + 2 * _ASTRAY, _WIDEST))


@dataclass(frozen=True)
class RingNearStops:
    """Near stops of one ring along a whole route."""

    sensors: int
    """Number of sensors."""
    always_full: int
    """Sensors with the full distance at every pose."""
    sometimes_less: int
    """Sensors with a shorter distance at some pose, and with some distance at every pose."""
    sometimes_none: int
    """Sensors without a near stop at some pose."""
    share: float
    """Share of sensors with the full distance, averaged over the route."""
    why: tuple[tuple[str, int], ...]
    """The robot's bodies that lower near stops, and for how many sensors each lowers it most."""


def by_ring(stops: NearStops, setup: Setup, bodies: Sequence[str]) -> list[RingNearStops]:
    """Summarise the near stops of each ring; ``bodies`` names the robot's bodies."""
    found = []
    for group, k in zip(setup.groups, setup.slices, strict=True):
        least, lowest = stops.least[:, k], stops.least[:, k].min(axis=0)  # (P, n), (n,)
        worst = stops.body[:, k][least.argmin(axis=0), np.arange(group.count)]  # (n,)
        names, counts = np.unique(worst[lowest < stops.full], return_counts=True)
        why = sorted(
            ((bodies[n], int(c)) for n, c in zip(names, counts, strict=True)), key=lambda x: -x[1]
        )
        none = int((lowest <= 0).sum())
        full = int((lowest >= stops.full).sum())
        found.append(
            RingNearStops(
                sensors=group.count,
                always_full=full,
                sometimes_less=group.count - none - full,
                sometimes_none=none,
                share=float((least >= stops.full).mean()),
                why=tuple(why),
            )
        )
    return found
