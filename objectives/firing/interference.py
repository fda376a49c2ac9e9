"""Which sensors of a setup may disturb each other by their light.

A sensor's light fills its beam, and it sees what lies in its beam; a beam is counted from its apex
on, up to the sensor's range. Two sensors may disturb each other in three ways:

- direct: one sensor's window lies in the beam of the other; or, at any distance, each window lies
  in the field of view of the other, as direct light is stronger than light that returns.
- overlap: their beams have a point in common. An object there returns the light of one to the
  other.
- reflection: a body of the scene, or of the robot, lies in the beam of one and, at any distance, in
  the field of view of the other. A large surface returns all light that falls on it, so only the
  way back counts against the range.

Pairs that are not listed are proven apart in all poses (``convex_bodies``). Bodies cast no shadow
here, and beams that are not convex are replaced by convex ones that hold them, so that more pairs
are listed than disturb each other. Sensors of wavelengths that are ``FILTER_NM`` apart, and models
that state that they are immune, do not disturb each other. What two returns do to each other beyond
one reflection is not modelled.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.choices import Disturbance
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ...coverage.sensors.effective_range import model_of
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.beams import Beams
from ...coverage.solids.convex_bodies import ConvexBodies, Discs, apart
from ...coverage.solids.sensor_beams import MixedBeams
from ..scene import Scene

WAYS: tuple[Disturbance, ...] = get_args(Disturbance)
FILTER_NM = 30.0  # nm, our assumption: a receiver's filter rejects light this far from its own
WINDOW = 0.003  # m, radius of a sensor's window: a package measures 4.9 by 2.5 mm


@dataclass(frozen=True)
class Interference:
    """The pairs of a setup's K sensors that may disturb each other at some poses."""

    pairs: Int[np.ndarray, "P 2"]
    """Numbers of the sensors of each pair, the smaller one first, in ascending order."""
    poses: Int[np.ndarray, "P 3"]
    """Number of poses at which a pair meets directly, by overlap and by reflection; a pose counts
    under the first of these that applies."""
    unlike: int
    """Number of pairs that are left out as their wavelengths differ, or as one is immune."""

    def conflicts(self, sensors: int) -> Bool[np.ndarray, "K K"]:
        """Return which of K sensors may disturb each other."""
        table = np.zeros((sensors, sensors), bool)
        table[tuple(self.pairs.T)] = True
        return table | table.T


def interference(
    scene: Scene,
    setup: Setup,
    reach: Disturbance = "reflection",
    tell: Callable[[], None] = lambda: None,
) -> Interference:
    """Return the pairs of sensors that may disturb each other at some pose of the scene.

    Args:
        scene: the scene; its sensors of the cell are left out.
        setup: the sensors.
        reach: which ways count: ``direct`` alone, ``overlap`` too, or ``reflection`` as well.
        tell: is called after each pose.
    """
    ring, kinds = setup.ring_of_sensor, [group.sensor for group in setup.groups]
    pairs = np.stack(np.triu_indices(setup.sensors, 1), axis=1)
    alike = may_disturb(kinds)[tuple(ring[pairs].T)]
    pairs, unlike = pairs[alike], int((~alike).sum())
    farthest = np.array([s.farthest for s in kinds])[ring]
    count = np.zeros((len(pairs), len(WAYS)), int)
    for pose in scene.poses:
        beams = sensor_cones(scene.robot, setup, pose.q)
        for kind, meet in enumerate(_meetings(beams, farthest, pairs, reach, scene, pose.q)):
            count[meet, kind] += 1
        tell()
    listed = count.any(axis=1)
    return Interference(pairs[listed], count[listed], unlike)


def may_disturb(sensors: Sequence[Sensor]) -> Bool[np.ndarray, "S S"]:
    """Return which kinds of sensors may disturb each other, by wavelength and immunity.

    An unknown wavelength may be any.
    """
    models = [None if s.use is None else model_of(s.use) for s in sensors]
    nm = np.array([np.nan if m is None else m.wavelength_nm or np.nan for m in models], float)
    immune = np.array([m is not None and m.immune for m in models], bool)
    other = np.abs(nm[:, None] - nm) >= FILTER_NM  # False for unknown ones
    may: np.ndarray = ~(other | immune[:, None] | immune)
    return may


def _meetings(
    beams: Beams,
    farthest: Float[np.ndarray, " K"],
    pairs: Int[np.ndarray, "P 2"],
    reach: Disturbance,
    scene: Scene,
    q: Float[np.ndarray, " J"],
) -> Iterator[Int[np.ndarray, " M"]]:
    """Yield which pairs meet in each way of ``WAYS``, up to ``reach``, and in none before."""
    apex = np.asarray(beams.apex)
    gaps = np.linalg.norm(apex[:, None] - apex, axis=-1)
    light = _up_to(beams, np.asarray(beams.range_m))
    field = _up_to(beams, (gaps + farthest).max(axis=1))  # as far as any beam reaches
    ways = np.concatenate([pairs, pairs[:, ::-1]])  # from one sensor to the other, and back
    lit, viewed = (
        (np.asarray(b.part(apex[ways[:, 1]], ways[:, 0])) <= WINDOW).reshape(2, -1)
        for b in (light, field)
    )
    direct = lit.any(axis=0) | viewed.all(axis=0)
    yield np.flatnonzero(direct)
    rest = np.flatnonzero(~direct)
    if reach == "direct" or not len(rest):
        return
    shapes = _convex(light)
    disjoint = apart(*(shapes[pairs[rest, i]] for i in range(2)))
    yield rest[~disjoint]
    rest = rest[disjoint]
    if reach == "overlap" or not len(rest):
        return
    yield rest[_reflected(shapes, _convex(field), pairs[rest], _bodies(scene, q, field))]


def _reflected(
    light: ConvexBodies,
    field: ConvexBodies,
    pairs: Int[np.ndarray, "P 2"],
    bodies: Sequence[Discs],
) -> Bool[np.ndarray, " P"]:
    """Return which pairs may meet on a body: it is in the beam of one sensor, and in the field of
    the other at the same place."""
    met = np.zeros(len(pairs), bool)
    if not bodies:
        return met
    solids = ConvexBodies.of(bodies)
    ways = np.concatenate([pairs, pairs[:, ::-1]])
    pair = np.tile(np.arange(len(pairs)), 2)
    near = ~apart(light[ways[:, 0]], field[ways[:, 1]])
    ways, pair = ways[near], pair[near]
    seen = np.stack(np.meshgrid(np.unique(ways[:, 0]), np.arange(len(solids))), axis=-1)
    seen = seen.reshape(-1, 2)
    seen = seen[~apart(light[seen[:, 0]], solids[seen[:, 1]])]
    way, k = np.nonzero(ways[:, :1] == seen[:, 0])
    both = light[ways[way, 0]], field[ways[way, 1]], solids[seen[k, 1]]
    met[pair[way[~apart(*both)]]] = True
    return met


def _up_to(beams: Beams, range_m: Float[np.ndarray, " K"]) -> Beams:
    """Return beams from their apexes on, up to other ranges."""
    if isinstance(beams, MixedBeams):
        return replace(beams, range_m=range_m, near=None)
    return replace(beams, range_m=range_m)


def _convex(beams: Beams) -> ConvexBodies:
    return ConvexBodies.of([beams.discs(k) for k in range(len(beams))])


def _bodies(scene: Scene, q: Float[np.ndarray, " J"], field: Beams) -> list[Discs]:
    """Return the bodies of the robot and of the cell; a floor as far as the fields reach."""
    up, reach = np.array([0.0, 0.0, 1.0]), float(np.abs(field.bounds()).max())
    bodies = list[Discs]()
    if scene.robot.bodies:
        capsules = robot_capsules(scene.robot, forward(scene.robot.chain, q))
        ends = np.stack([capsules.start, capsules.end], axis=1)
        for end, radius in zip(ends, capsules.radius, strict=True):
            bodies.append(Discs(end, np.zeros(2), up, float(radius)))
    for solid in (*carried_polyhedra(scene.robot, q), *(o.body for o in scene.obstacles)):
        if len(solid.edges):
            corners = np.unique(solid.edges.reshape(-1, 3), axis=0)
            bodies.append(Discs(corners, np.zeros(len(corners)), up))
        else:
            depth = np.array([[solid.offset[0]], [solid.offset[0] - 2 * reach]])
            bodies.append(Discs(depth * solid.normal[0], np.full(2, 2 * reach), solid.normal[0]))
    return bodies
