"""Sample points of the exchange, in each mount's coordinates, with the line-of-sight tables of its
sensors."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Setup
from ...coverage.robots.kinematics import forward
from ...objectives.occlusion import occluders, setup_sight
from ...objectives.target_points import TargetPoints
from .design import Space
from .ring_visibility import Around, around
from .visibility_table import VisibilityTable, build_visibility_table

_FEWEST = 8  # fewest points of a goal at a pose
_LOOKED_AT = 8192  # most points with occluders
_BLINDED = 16  # most poses for which the first return is modelled; beyond them, shadows


@dataclass(frozen=True)
class Field:
    """Points of all goals at all poses."""

    part: Float[np.ndarray, "N G"]
    """Share of each point in each goal's ζ."""
    around: dict[str, Around]
    """The points in each link's mount coordinates."""
    past: dict[str, VisibilityTable]
    """Line-of-sight table of each link's sensors."""
    held: Bool[np.ndarray, " N"]
    """Whether a single sensor or one of the cell covers each point, which they do exactly."""


class Fields:
    """A scene's points in mount coordinates; a field takes the first points of each term."""

    def __init__(self, space: Space, points: TargetPoints) -> None:
        scene, each = space.scene, points.points[: len(points.points) // points.mountings]
        self._terms = points.terms[: len(each)]
        goal, pose = (np.array(column) for column in zip(*self._terms, strict=True))
        self._parts = scene.pose_weights[pose][:, None] * (
            goal[:, None] == np.arange(len(scene.goals))
        )
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._most, self._past = len(each[0]), dict[str, VisibilityTable]()
        if scene.occlusion != "ignore" or scene.obstacles:
            self._most = min(self._most, max(_LOOKED_AT // len(each), _FEWEST))
            each = [some[: self._most] for some in each]
            self._past = _lookouts(space, frames, each, [p for _, p in self._terms])
        self._each = [
            {m.link: around(m, frames[p, m.frame], some) for m in scene.robot.mounts}
            for (_, p), some in zip(self._terms, each, strict=True)
        ]
        standing = Setup((), scene.standing)
        bare = replace(scene, cell_sensors=())
        self._held = [
            setup_sight(bare, standing, scene.poses[p].q).holds(some[: self._most])
            for (_, p), some in zip(self._terms, each, strict=True)
        ]
        self.all = self.first(self._most * len(self._terms))

    def first(self, count: int) -> Field:
        """Return a field of about ``count`` points: the first points of each pair of goal
        and pose."""
        n = min(max(count // len(self._terms), _FEWEST), self._most)
        part = np.repeat(self._parts / n, n, axis=0).astype(np.float32)
        parts = {link: [each[link] for each in self._each] for link in self._each[0]}
        joined = {
            x: Around(*(np.concatenate([a[:n] for a in c]) for c in zip(*p, strict=True)))
            for x, p in parts.items()
        }
        number = (np.arange(len(self._terms))[:, None] * self._most + np.arange(n)).ravel()
        return Field(
            part,
            {link: points._replace(number=number) for link, points in joined.items()},
            self._past,
            np.concatenate([held[:n] for held in self._held]),
        )


def _lookouts(
    space: Space, frames: Float[np.ndarray, "P F 4 4"], points: list[np.ndarray], pose: list[int]
) -> dict[str, VisibilityTable]:
    """Return the line-of-sight table of each link's sensors."""
    scene, tables = space.scene, {}
    way = [occluders(scene, p.q) for p in scene.poses]
    for link in {s.link for s in space.segments} | {r.link for r in space.fixed}:
        mount, sensor = scene.robot.mount(link), space.ring(link, 1).sensor
        blinded = scene.occlusion == "blind" and not sensor.zoned and len(way) <= _BLINDED
        tables[link] = build_visibility_table(
            mount, space.radii[link], sensor, frames[:, mount.frame], way, points, pose, blinded
        )
    return tables
