"""Part of a target that no sensor of any layout covers: an upper bound on coverage.

The bound is the union over all rings that the rules allow: every position on a link, every tilt and
every phase, as if rings of all places were mounted at once. A grid of places stands for them, and
each test holds for all places of a cell of the grid together, so that it errs towards covered:

* The beam is that of the phase in the cell nearest to the point, widened by half the spacing of the
  positions. A square beam counts as the cone around it.
* A body occludes a point if it does so for the whole ball about the cell, that is, if the cell's
  middle lies deeper in the body's shadow from the point than the ball's radius (the shadow's
  function is 1-Lipschitz).
* Sensors whose targets bodies take (``returns``, ``blind``) cover no point that ``shadow`` does
  not, so shadows stand for all three.

What remains is the Monte Carlo error of the points, and of the poses where a scene has many.
"""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Covered
from ..coverage.occlusion.occluders import Occluders
from ..coverage.ring_views.mount_points import MountPoints, mount_points
from ..coverage.rings.ring import Setup
from ..coverage.robots.kinematics import forward
from ..coverage.robots.robot import Mount
from ..coverage.sensors.sensor import Sensor
from ..coverage.solids.capsule_shadows import behind, capsule_shadow
from ..coverage.solids.polyhedra import largest, polyhedron_shadow
from ..coverage.solids.segments import point_to_segment, segment_to_segment
from ..coverage.targets.target import Target
from .feasibility.clearance import MountClearance
from .link_segments import TILTS
from .occlusion import occluders, setup_sight
from .scene import Scene

_POINTS = 8192  # sampled in the target, over all poses
_POSES = 16  # most poses, drawn from the scene's
_SPACING = 0.03  # m, between neighbouring places of the grid
_SLACK = 1e-4  # m, for rounding
_EDGE = 0.01  # m, by which a ring's interval may exceed the tabulated one
_BATCH = 1 << 16  # pairs of a point and a place in one batch


@definition
class Beyond:
    """The part of a target that no layout covers."""

    share: Annotated[float, Covered("percent")]
    """Part of the target that is beyond any sensor that the rules allow."""
    error: Annotated[float, Covered("error_percent")]
    """Largest Monte Carlo error of the part, of points and poses, at a confidence of 95 %."""


class PlaceGrid(NamedTuple):
    """The rings of a link on a grid: cells of a position and a phase."""

    mount: Mount
    sensor: Sensor
    radius: float
    """Radius of the rings, m."""
    tilt: tuple[float, float]
    """Lowest and highest tilt, rad."""
    height: Float[np.ndarray, " H"]
    """Heights of the cells from the mount's start, m."""
    half: float
    """Half the height of a cell, m."""
    phase: Float[np.ndarray, " A"]
    """Phases of the cells, rad."""

    @property
    def ball(self) -> float:
        """Radius of a ball about a cell's middle that holds all apexes of the cell, m."""
        return math.hypot(self.half, 2 * self.radius * math.sin(math.pi / len(self.phase) / 2))


def beyond_sensors(
    scene: Scene, target: Target, points: int = _POINTS, besides: Setup | None = None
) -> Beyond:
    """Return the share of ``target`` that no layout of ``scene`` covers, as a mean over the poses.

    Args:
        scene: the scene; its fixed rings and sensors and those of the cell cover what they see.
        target: the target.
        points: points to sample, over all poses.
        besides: a setup that covers what it sees, whether the rules allow its sensors or not.

    Raises:
        ValueError: as ``Scene.solid`` does.
        EmptySolidError: for an empty target.
    """
    weights = np.asarray(scene.pose_weights, float)
    poses, drawn = np.arange(len(weights)), len(weights) > _POSES
    if drawn:  # one pose in each of equal steps along the weights, in proportion to them
        along = (np.arange(_POSES) + np.random.default_rng(0).random(_POSES)) / _POSES
        poses = np.searchsorted(np.cumsum(weights)[:-1], along, side="right")
        weights = np.full(_POSES, 1 / _POSES)
    each, places = max(points // len(poses), 512), _places(scene)
    samples = (scene.sample(target, i, each, k) for k, i in enumerate(poses.tolist()))
    each_pose = zip(poses.tolist(), samples, strict=True)
    shares = np.array(
        [beyond(scene, drawn, pose, besides, places).mean() for pose, drawn in each_pose]
    )
    spread = np.maximum(shares * (1 - shares), 1 / each)  # of none out of N: about 3 / N
    variance = float(weights**2 @ spread) / each
    if drawn:
        variance += float(np.var(shares, ddof=1)) / len(shares)
    return Beyond(float(weights @ shares), 1.96 * math.sqrt(variance))


def _places(scene: Scene) -> list[PlaceGrid]:
    """Return the grids of rings on all links on which the rules leave room."""
    clear, grids = MountClearance(scene) if scene.real else None, []
    for mount in scene.robot.mounts:
        limits, length = scene.limits_of(mount.link), mount.length
        radius = clear.radius(mount.link) if clear else scene.radius_of(mount.link)
        margin = scene.rules.from_joints / length if length else 0.0
        low, high = max(limits.position[0], margin), min(limits.position[1], 1 - margin)
        if length == 0:
            low = high = 0.0
        ends = [(low, high)]
        if clear is not None:
            room = clear.rooms({mount.link: radius}, scene.rules.fixed)[mount.link].clear
            step = TILTS[1] - TILTS[0]
            ends = [
                (max(a, low), min(b, high))
                for tilt, some in zip(TILTS, room, strict=True)
                if limits.tilt[0] - step <= tilt <= limits.tilt[1] + step
                for a, b in some
            ]
        more = _EDGE if clear is not None else 0.0
        heights, half = _cells([(a * length, b * length) for a, b in ends if a <= b], more)
        for a, b in limits.keep_out:  # a ring may sit at its very ends
            kept = (heights - half > a * length) & (heights + half < b * length)
            heights = heights[~kept] if length else heights[: 0 if a <= 0 <= b else None]
        around = max(8, math.ceil(2 * math.pi * radius / _SPACING))
        phase = np.arange(around) * (2 * math.pi / around)
        sensor = scene.sensor_of(mount.link)
        if len(heights):
            grids.append(PlaceGrid(mount, sensor, radius, limits.tilt, heights, half, phase))
    return grids


def _cells(ends: list[tuple[float, float]], more: float) -> tuple[Float[np.ndarray, " H"], float]:
    """Return the middles of cells that hold intervals enlarged by ``more`` m, and half a cell."""
    if not ends:
        return np.zeros(0), 0.0
    low, high = min(a for a, _ in ends) - more, max(b for _, b in ends) + more
    count = max(1, math.ceil((high - low) / _SPACING))
    half = (high - low) / count / 2
    middles = low + half * (1 + 2 * np.arange(count))
    held = [any(a - more <= m + half and m - half <= b + more for a, b in ends) for m in middles]
    return middles[held], half


def beyond(
    scene: Scene,
    points: Float[np.ndarray, "N 3"],
    pose: int,
    besides: Setup | None = None,
    places: Sequence[PlaceGrid] | None = None,
) -> Bool[np.ndarray, " N"]:
    """Return which points, m, no sensor of any layout covers at a pose.

    Args:
        scene: see ``beyond_sensors``.
        points: the points.
        pose: number of the pose.
        besides: see ``beyond_sensors``.
        places: where rings may be; None: computed.
    """
    q, rules = scene.poses[pose].q, scene.rules
    frames = np.asarray(forward(scene.robot.chain, q))
    hidden = _Hidden(occluders(scene, q), points)
    left = np.ones(len(points), bool)
    if rules.fixed or scene.standing:
        left &= ~setup_sight(scene, Setup(rules.fixed, rules.fixed_sensors), q).holds(points)
    if besides is not None and besides.groups:
        left &= ~setup_sight(scene, besides, q).holds(points)
    rest = np.flatnonzero(left & ~hidden.inside)
    for grid in _places(scene) if places is None else places:
        more = _left(grid, np.asarray(frames[grid.mount.frame]), hidden, rest)
        left[np.setdiff1d(rest, more)] = False
        rest = more
    return left


def _left(
    grid: PlaceGrid, frame: Float[np.ndarray, "4 4"], hidden: "_Hidden", rest: Int[np.ndarray, " K"]
) -> Int[np.ndarray, " L"]:
    """Return which of the points with the numbers ``rest`` no ring of a link covers."""
    mount = grid.mount
    cells = np.stack(np.meshgrid(grid.height, grid.phase, indexing="ij"), axis=-1).reshape(-1, 2)
    cells = np.random.default_rng(0).permutation(cells)  # most points are soon covered
    height, phase = cells[:, :1], cells[:, 1:]
    apex = np.asarray(mount.start) + height * mount.axis
    apex = apex + grid.radius * (np.cos(phase) * mount.zero + np.sin(phase) * mount.side)
    apex = apex @ frame[:3, :3].T + frame[:3, 3]
    live = np.flatnonzero(~hidden.blind(apex, grid.ball))
    done = 0
    while done < len(live) and len(rest):
        some = live[done : done + max(_BATCH // len(rest), 4)]
        local = mount_points(mount, frame, hidden.points[rest])
        k, a = np.nonzero(_in_beams(grid, local, cells[some]))
        clear = ~hidden.pairs(rest[k], apex[some[a]], grid.ball)
        rest = np.delete(rest, np.unique(k[clear]))
        done += len(some)
    return rest


def _in_beams(
    grid: PlaceGrid, points: MountPoints, cells: Float[np.ndarray, "A 2"]
) -> Bool[np.ndarray, "K A"]:
    """Return which points may lie in a beam of a cell, without occlusion."""
    sensor, slack = grid.sensor, grid.half + _SLACK
    half = math.pi / len(grid.phase)
    turn = points.azimuth[:, None] - cells[:, 1]
    turn -= 2 * math.pi * np.rint(turn / (2 * math.pi))
    turn -= np.clip(turn, -half, half)  # from the nearest phase of the cell
    out = points.radius[:, None] * np.cos(turn) - grid.radius
    aside = points.radius[:, None] * np.sin(turn)
    up = points.height[:, None] - cells[:, 0]
    plane = out * out + up * up
    inside = plane + aside * aside <= (sensor.farthest + slack) ** 2
    angle = sensor.outer_angle
    if angle > math.pi / 2:
        return np.asarray(inside)
    raised = np.arctan2(up, out)
    raised -= np.clip(raised, *grid.tilt)  # from the nearest tilt
    along = np.sqrt(plane) * np.cos(raised)
    across = np.sqrt(plane * np.sin(raised) ** 2 + aside * aside)
    inside &= across * math.cos(angle) - along * math.sin(angle) <= slack
    inside &= along >= sensor.near_m - slack
    return np.asarray(inside)


class _Hidden:
    """Which points bodies hide from whole balls of apexes."""

    def __init__(self, past: Occluders, points: Float[np.ndarray, "N 3"]) -> None:
        self.points, self._past = points, past
        self.inside = np.zeros(len(points), bool)
        """Which points lie in bodies of the robot."""
        self._capsules = []
        if past.bodies is not None:
            for start, end, radius in zip(*past.bodies.arrays(), strict=True):
                thin = radius - _SLACK  # no point that counts as outside lies on its surface
                self._capsules.append((start, end, thin))
                self.inside |= point_to_segment(points, start, end) <= thin
        self._planes = [polyhedron_shadow(points, body) for body in past.obstacles]

    def blind(self, apex: Float[np.ndarray, "A 3"], ball: float) -> Bool[np.ndarray, " A"]:
        """Return which balls about apexes lie wholly in a body."""
        within, depth = self._past.holds(apex)
        return (within >= 0) & (depth > ball + _SLACK)

    def pairs(
        self, index: Int[np.ndarray, " T"], apex: Float[np.ndarray, "T 3"], ball: float
    ) -> Bool[np.ndarray, " T"]:
        """Return whether a body hides point ``index`` from all of a ball about ``apex``, m."""
        deep, hidden = -(ball + _SLACK), np.zeros(len(index), bool)
        for normal, offset in self._planes:
            todo = np.flatnonzero(~hidden)
            n, o = normal[index[todo]], offset[index[todo]]
            faces = (n != 0).any(axis=(1, 2))
            hidden[todo] = faces & (largest(apex[todo], n, o) <= deep)
        for start, end, radius in self._capsules:
            todo = np.flatnonzero(~hidden)
            point, at = self.points[index[todo]], apex[todo]
            near = segment_to_segment(point, at, start, end) < radius
            todo, point, at = todo[near], point[near], at[near]
            if len(todo):
                hidden[todo] = behind(at, capsule_shadow(point, start, end, radius)) <= deep
        return hidden
