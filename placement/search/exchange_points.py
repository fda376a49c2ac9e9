"""Sample points of the exchange, in each mount's coordinates, with the occluders of its sensors."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8, UInt16

from ...coverage.occlusion.occlusion_mode import REPORTING
from ...coverage.ring_views.balls import STEPS, met_balls
from ...coverage.ring_views.detections import Detections
from ...coverage.ring_views.line_of_sight import LinkOccluders, Outlook, link_occluders
from ...coverage.ring_views.mount_points import MountPoints, RingErrors, mount_points, ring_errors
from ...coverage.rings.mounting_errors import Misplaced, misplaced_cones
from ...coverage.rings.ring import Group, setup_of_group
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.base import Parts
from ...coverage.solids.beams import Beams, InBeam
from ...objectives.criterion import Criterion, check_criterion
from ...objectives.detection_share import noticed_in
from ...objectives.gap_goals import with_gap_goals
from ...objectives.occlusion import occluders, sight
from ...objectives.scene import Scene
from ...objectives.smallest_object import ON_BEAM
from ...objectives.target_points import TargetPoints
from ..space.design import Space

ACTIVE = 16  # poses at which a candidate is improved where the worst of more poses counts
# points of each pose at which it is then judged: at most, at least, and of all poses together
_JUDGED, _FEW, _MANY = 1024, 32, 1 << 19
_FEWEST = 8  # fewest points of a goal at a pose
_LEAST = 256  # fewest where these are not too many, with thousands of poses, for the memory
_COUNTED = 255  # sensors counted at a point
_BLINDED = 16  # most poses for which first returns are modelled; beyond them, shadows


def active_poses(scene: Scene) -> bool:
    """Return whether candidates are improved at few poses only: those that are worst for them."""
    return scene.over_poses == "worst" and len(scene.poses) > ACTIVE


@dataclass(frozen=True)
class HeldViews:
    """What H groups that may err and fail, and the cell's sensors, see of N points."""

    count: UInt8[np.ndarray, "H N"]
    """Number of sensors of each group that see each point, or the integers of ``Detections``."""
    sensor: UInt16[np.ndarray, "H N"]
    """Number, in its group, of a sensor that sees the point."""
    cell: UInt8[np.ndarray, " N"]
    """Those of the cell's sensors."""

    def first(self, count: int) -> "HeldViews":
        """Return what they see of the first points."""
        return HeldViews(*(views[..., :count] for views in vars(self).values()))


@dataclass(frozen=True)
class Field:
    """Points of all goals at some poses, in all mountings."""

    scene: Scene
    """The scene, with the goals of the search."""
    part: Float[np.ndarray, "N G"]
    """Share of each point in the mean of each goal over the poses."""
    in_pose: Float[np.ndarray, " N"]
    """Share of each point in the mean over the goals at its pose."""
    points: dict[str, MountPoints]
    """The points in each link's mount coordinates."""
    past: dict[str, LinkOccluders]
    """Occluders of each link's sensors; empty where nothing occludes."""
    errors: tuple[RingErrors, ...] | None
    """Mounting errors of each place for a ring; None: perfect mounting."""
    held: HeldViews
    """What fixed rings, single sensors and the cell's sensors see."""
    pose: Int[np.ndarray, " N"]
    """Pose of each point."""
    outlook: dict[str, Outlook]
    """Guessed lines of sight of each link's rings; empty where nothing hides points, and where
    bodies take targets of sensors."""

    @cached_property
    def total(self) -> Float[np.ndarray, " G"]:
        """Sum of the parts: the value of each goal where all points are covered."""
        total: np.ndarray = self.part.sum(axis=0, dtype=float)
        return total


class Fields:
    """A scene's points in mount coordinates; a field takes the first points of each term."""

    @classmethod
    def drawn(cls, space: Space, aim: Criterion, points: int, seed: int) -> "Fields":
        """Draw at least ``points`` points of all goals, poses and mountings together.

        Raises:
            ValueError: for an empty target, or floors of goals that the criterion does not support.
        """
        check_criterion(space.scene, aim)
        scene = with_gap_goals(space.scene) if aim.plain else space.scene
        goals = len(scene.targets) * aim.mountings
        poses = ACTIVE if active_poses(scene) else len(scene.poses)
        least = min(_LEAST, max(_FEWEST, _MANY // (goals * len(scene.poses))))
        count = max(least, points // (goals * poses))
        return cls(space, TargetPoints(scene, count, seed, aim.mountings, aim.plain), aim)

    def __init__(self, space: Space, points: TargetPoints, aim: Criterion | None = None) -> None:
        """Compute once what fields share."""
        self.space, self.scene, self.aim = space, points.scene, aim or Criterion()
        self.points, scene = points, self.scene
        self._goal, self._pose = (np.array(c) for c in zip(*points.terms, strict=True))  # (T,)
        self._share = 1 / points.mountings
        self._most = len(points.points[0])
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        mounting = np.arange(len(self._pose)) // (len(self._pose) // points.mountings)
        each = self._pose.tolist(), mounting.tolist(), points.points, points.radius
        terms = list(zip(*each, strict=True))
        mounts = {s.link: scene.robot.mount(s.link) for s in space.segments}
        self._each = {
            link: [
                mount_points(m, frames[p, m.frame], some, p, d, r if math.isfinite(r) else 0.0)
                for p, d, some, r in terms
            ]
            for link, m in mounts.items()
        }
        self._past = dict[str, LinkOccluders]()
        if scene.occlusion != "ignore" or scene.obstacles:
            way = [occluders(scene, p.q) for p in scene.poses]
            many = scene.occlusion in REPORTING and len(way) > _BLINDED
            occlusion = "shadow" if many else scene.occlusion
            self._past = {
                link: link_occluders(m, frames[:, m.frame], way, occlusion)
                for link, m in mounts.items()
            }
        self._errors, of_held = _errors(space, self.aim)
        groups: tuple[Group, ...] = (*scene.rules.fixed, *scene.rules.fixed_sensors)
        detections = None if self.aim.detection is None else Detections(self.aim.detection)
        self._held = [
            _held_views(scene, groups, p, some, r, None if of_held is None else of_held[d])
            if detections is None
            else _held_detections(scene, groups, p, some, detections)
            for p, d, some, r in terms
        ]
        self._first = dict[int, Field]()
        self.all = self.first(self._most * len(terms))

    @cached_property
    def wide(self) -> Field | None:
        """A field of all poses by which candidates are judged where the worst of many counts, while
        each is improved at the poses that are worst for it; None elsewhere."""
        if not active_poses(self.scene):
            return None
        poses = len(self.scene.poses)
        return self.first(min(_JUDGED, max(_FEW, _MANY // poses)) * poses)

    def first(self, count: int, poses: Int[np.ndarray, " A"] | None = None) -> Field:
        """Return a field of about ``count`` points: the first points of each term at ``poses``, by
        default at all of them.

        That one is kept, with its guessed lines of sight.
        """
        if poses is not None:
            return self._field(count, poses)
        if count not in self._first:
            self._first[count] = self._field(count, None)
        return self._first[count]

    def _field(self, count: int, poses: Int[np.ndarray, " A"] | None) -> Field:
        weights = self.scene.pose_weights
        some = np.arange(len(self._pose))  # (T,), terms
        if poses is not None:
            some = np.flatnonzero(np.isin(self._pose, poses))
            weights = weights / weights[np.unique(self._pose[some])].sum()
        n = min(max(count // len(some), _FEWEST), self._most)
        goal, pose = self._goal[some], self._pose[some]
        part = (weights[pose] * self._share)[:, None] * (
            goal[:, None] == np.arange(len(self.scene.targets))
        )
        in_pose = self.scene.goal_weights[goal] * self._share
        points = {
            link: MountPoints(
                *(
                    np.concatenate([a[:n] for a in column])
                    for column in zip(*(each[i] for i in some), strict=True)
                )
            )
            for link, each in self._each.items()
        }
        held = (vars(self._held[i].first(n)).values() for i in some)
        return Field(
            self.scene,
            np.repeat(part / n, n, axis=0).astype(np.float32),
            np.repeat(in_pose / n, n).astype(np.float32),
            points,
            self._past,
            self._errors,
            HeldViews(*(np.concatenate(views, axis=-1) for views in zip(*held, strict=True))),
            np.repeat(pose, n),
            {
                link: Outlook(points[link], past, self.space.radii[link])
                for link, past in self._past.items()
                if past.occlusion not in REPORTING
            },
        )


def _errors(
    space: Space, aim: Criterion
) -> tuple[tuple[RingErrors, ...] | None, list[list[Misplaced]] | None]:
    """Return the errors of each place for a ring, and in each mounting those of each fixed ring and
    single sensor; None without errors.

    They are common random numbers: those of a place and of each of its sensors do not depend on the
    setup.
    """
    groups: tuple[Group, ...] = (*space.scene.rules.fixed, *space.scene.rules.fixed_sensors)
    each = max([space.most, *(r.count for r in (space.layout.rings if space.layout else ()))])
    counts = [each] * space.places + [g.count for g in groups]
    first = np.cumsum([0, *counts])
    drawn = aim.drawn(len(counts), int(first[-1]))
    if drawn is None:
        return None, None
    number = [range(a, a + n) for a, n in zip(first, counts, strict=False)]
    errors = tuple(ring_errors(drawn, i, number[i]) for i in range(space.places))
    of_held = [
        [
            Misplaced(
                drawn.slip[d : d + 1, i : i + 1],
                drawn.turn[d : d + 1, i : i + 1],
                drawn.seat[d : d + 1, list(number[i])],
            )
            for i in range(space.places, len(counts))
        ]
        for d in range(len(drawn))
    ]
    return errors, of_held


def _held_views(
    scene: Scene,
    groups: tuple[Group, ...],
    pose: int,
    points: Float[np.ndarray, "N 3"],
    ball: float,
    errors: list[Misplaced] | None,
) -> HeldViews:
    """Return what ``groups``, with their ``errors`` in one mounting, and the cell's sensors see of
    points at a pose, or of balls of the radius ``ball``, m, about them."""
    q, n = scene.poses[pose].q, len(points)
    bare = replace(scene, cell_sensors=())
    count, sensor = np.zeros((len(groups), n), np.uint8), np.zeros((len(groups), n), np.uint16)
    cell = np.full(n, int(math.isinf(ball)))  # a ball without room needs no sensor
    for i, group in enumerate((*groups, *scene.cell_sensors)):
        setup = setup_of_group(group)
        if errors is None or i >= len(groups):
            cones = sensor_cones(scene.robot, setup, q)
        else:
            (cones,) = misplaced_cones(scene.robot, setup, q, errors[i])
        seen = sight(bare, cones, q)
        each = np.zeros((max(group.count, 1), n), bool)
        for k in range(group.count):
            each[k] = _sees(seen, cones, k, group.sensor, points, ball)
        if i >= len(groups):
            cell += each.sum(axis=0)
        else:
            count[i], sensor[i] = np.minimum(each.sum(axis=0), _COUNTED), each.argmax(axis=0)
    return HeldViews(count, sensor, np.minimum(cell, _COUNTED).astype(np.uint8))


def _sees(
    seen: Parts, cones: Beams, k: int, sensor: Sensor, points: Float[np.ndarray, "N 3"], ball: float
) -> Bool[np.ndarray, " N"]:
    """Return which points sensor ``k`` sees, or a part of balls
    of the radius ``ball``, m, about them."""
    if not 0 < ball < math.inf:
        return np.asarray(seen.part(points, np.full(len(points), k))) <= 0
    axis, apex, sees = (
        np.asarray(cones.axis)[k],
        np.asarray(cones.apex)[k],
        np.zeros(len(points), bool),
    )
    frame = np.stack([axis, *cones.sides(k)])  # along the axis, across, and along ``up``
    at = InBeam(*((points - apex) @ frame.T).T)
    for step in STEPS:
        met, moved = met_balls(sensor, at, np.full(len(points), ball), step)
        there = points + moved @ frame
        sees |= met & (np.asarray(seen.part(there, np.full(len(points), k))) <= ON_BEAM)
    return sees


def _held_detections(
    scene: Scene,
    groups: tuple[Group, ...],
    pose: int,
    points: Float[np.ndarray, "N 3"],
    detections: Detections,
) -> HeldViews:
    """Return what ``groups`` and the cell's sensors contribute to the detection of a test piece at
    points at a pose."""
    bare, n = replace(scene, cell_sensors=()), len(points)
    rows = np.zeros((len(groups) + len(scene.cell_sensors), n))
    for row, group in zip(rows, (*groups, *scene.cell_sensors), strict=True):
        law = noticed_in(bare, setup_of_group(group), pose, detections.detection)
        for k in range(group.count):
            chance = law.chance(points[None], np.full(n, k))[0, 0]
            row += detections.integers(np.log1p(-np.minimum(chance, 1 - 1e-9)))
    held, own = np.minimum(rows, _COUNTED).astype(np.uint8), len(groups)
    cell = np.minimum(held[own:].sum(axis=0, dtype=int), _COUNTED).astype(np.uint8)
    return HeldViews(held[:own], np.zeros((own, n), np.uint16), cell)
