"""Where a person can stand around the robot unseen, and get close to it unseen, on a floor grid.

A person is an upright capsule of the smallest stature of ``Person``, which is the hardest to see.
It stands at the centre of each square with room. A sensor sees it as in the simulation of
approaches: any part of it is in the beam, within range, and not occluded. The distance to each part
of the robot is compared with that part's separation distance at the same moment.

A person gets close unseen along squares that touch by an edge or a corner. Paths begin at the edge
of the grid, which lies beyond every separation distance, or at the edge of the walkable areas.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Pair
from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.person_reach import SHOULDER, Person, statures
from ...coverage.rings.ring import Setup
from ...coverage.solids.segments import segment_to_segment
from ...objectives.scene import Scene
from ..detection import floor_of
from ..human import ball_counts, balls_along
from ..motion_samples import Moments
from ..sightings import seen_by

SIDE = 0.1  # m, of a square
_MOST_SQUARES = 200  # on a side of the grid; of a larger one the squares are larger
MOST_MOMENTS = 12
_ERROR = 0.01  # m, by which the capsule may protrude from the balls that sensors see
_AT_ONCE = 512  # places in memory
_AROUND = np.ones((3, 3), bool)


@dataclass(frozen=True)
class Floor:
    """The squares of the floor around the robot, X by Y, at M moments of its motion."""

    x: Float[np.ndarray, " X"]
    """Centres along x, m."""
    y: Float[np.ndarray, " Y"]
    """Centres along y, m."""
    side: float
    """Side of a square, m."""
    height: float
    """Height of the floor, m."""
    person: Person
    """Where people walk, and their size."""
    moments: Int[np.ndarray, " M"]
    """Numbers of the moments."""
    room: Bool[np.ndarray, "X Y"]
    """Where a person has room."""
    outside: Bool[np.ndarray, "X Y"]
    """Where people come from."""
    unseen: Bool[np.ndarray, "M X Y"]
    """Where no sensor sees a person."""
    within: Bool[np.ndarray, "M X Y"]
    """Where a person is nearer to a part of the robot than its separation distance."""

    @property
    def never_seen(self) -> Bool[np.ndarray, "X Y"]:
        """Squares with room in which a person is unseen at every moment."""
        return np.asarray(self.room & self.unseen.all(axis=0))

    @property
    def at_times_unseen(self) -> Bool[np.ndarray, "X Y"]:
        """Squares with room in which a person is unseen at one moment or more."""
        return np.asarray(self.room & self.unseen.any(axis=0))

    @property
    def near(self) -> Bool[np.ndarray, "X Y"]:
        """Squares with room that are within the separation distance at one moment or more."""
        return np.asarray(self.room & self.within.any(axis=0))

    @property
    def near_unseen(self) -> Bool[np.ndarray, "X Y"]:
        """Squares with room that are within the separation distance, and unseen, at one moment."""
        return np.asarray(self.room & (self.unseen & self.within).any(axis=0))

    @property
    def access(self) -> Bool[np.ndarray, "X Y"]:
        """Near squares that a person reaches through squares that are never seen."""
        return np.asarray(self.near & reached(self.never_seen, self.outside))

    @property
    def possible_access(self) -> Bool[np.ndarray, "X Y"]:
        """Near squares that a person reaches through squares that are unseen at some moment."""
        return np.asarray(self.near & reached(self.at_times_unseen, self.outside))


@definition(kw_only=True)
class FloorRecord:
    """Where a person can stand, and get close, unseen; areas are sums of whole squares."""

    side_m: float
    """Side of the squares, m."""
    x_m: Pair[float]
    """Lowest and highest x of the grid, m, base frame."""
    y_m: Pair[float]
    """Lowest and highest y of the grid, m, base frame."""
    floor_m: float
    """Height of the floor, m, base frame."""
    stature_m: float
    """Stature of the person, m."""
    radius_m: float
    """Radius of the person, m."""
    moments: int
    """Number of moments that were examined."""
    of_moments: int
    """Number of moments of the motion."""
    room_m2: float
    """Area in which a person has room, m²."""
    near_m2: float
    """Area within the separation distance at one moment or more, m²."""
    never_seen_m2: float
    """Area in which a person is never seen, m²."""
    at_times_unseen_m2: float
    """Area in which a person is unseen at one moment or more, m²."""
    near_unseen_m2: float
    """Area within the separation distance and unseen at the same moment, m²."""
    access_m2: float
    """Area within the separation distance that is reached through places that are never seen, m²:
    undetected access."""
    possible_access_m2: float
    """The same through places that are unseen at one moment or more, m²."""
    largest_radius_m: float | None = None
    """Radius of the largest upright cylinder that stands unseen within the separation distance, m,
    to within a square's side."""
    largest_at_m: Pair[float] | None = None
    """Place (x, y) of its axis, m."""


def reached(
    passable: Bool[np.ndarray, "X Y"], start: Bool[np.ndarray, "X Y"]
) -> Bool[np.ndarray, "X Y"]:
    """Return the passable squares that are joined, by edges or corners, to passable ones of
    ``start``."""
    from scipy.ndimage import label

    parts, _ = label(passable, _AROUND)
    first = np.unique(parts[passable & start])
    return passable & np.isin(parts, first)


def examined(m: Moments) -> Int[np.ndarray, " M"]:
    """Return the moments to examine: all, or some spread over the motion and that of the largest
    separation distance."""
    count = len(m.weight)
    if count <= MOST_MOMENTS:
        return np.arange(count)
    worst = int(m.required.max(axis=1).argmax())
    spread = np.linspace(0, count - 1, MOST_MOMENTS - 1).astype(int)
    return np.unique([*spread.tolist(), worst])


def floor_grid(scene: Scene, setup: Setup, m: Moments, occlusion: Occlusion) -> Floor:
    """Return the floor around the robot with what sensors see on it.

    Args:
        scene: robot, obstacles, people, and sensors of the cell, which count.
        setup: the setup whose sensors observe.
        m: moments of the motion, with whole separation distances.
        occlusion: occlusion model.
    """
    person = Person() if scene.person is None else scene.person
    height = floor_of(scene) if person.floor is None else max(person.floor, floor_of(scene))
    at, bodies = examined(m), tuple(o.body for o in scene.obstacles)
    ends = np.concatenate([m.start[at], m.end[at]], axis=1)
    far = np.hypot(*ends.T[:2]).T.reshape(len(at), 2, -1).max(axis=1) + m.radius + m.required[at]
    half = float(far.max()) + person.radius + 3 * SIDE
    side = max(SIDE, 2 * half / _MOST_SQUARES)
    squares = int(np.ceil(half / side))
    axis = (np.arange(-squares, squares) + 0.5) * side
    shape = (len(axis), len(axis))
    x, y = (a.ravel() for a in np.meshgrid(axis, axis, indexing="ij"))
    room = statures(bodies, person, height, x, y, side) > 0
    free = statures(bodies, replace(person, areas=()), height, x, y, side) > 0
    stature = person.shoulder / SHOULDER
    low, high = height + person.radius, height + stature - person.radius
    columns = np.stack([np.stack([x, y, np.full(len(x), z)], axis=1) for z in (low, high)])
    beyond = (free & (room == 0)).reshape(shape)
    gap = np.stack([_gaps(columns, m, i) for i in at]) - person.radius  # (M, G, N)
    room &= ~(gap <= 0).any(axis=2).all(axis=0)  # less where the robot always is
    observing, unseen = scene.with_cell(setup), np.ones((len(at), len(x)), bool)
    some = np.flatnonzero(room)
    for i, moment in enumerate(at):
        seen = _seen(scene, observing, m, int(moment), columns[:, some], person.radius, occlusion)
        unseen[i, some] = ~seen
    within = (gap < m.required[at][:, None]).any(axis=2)
    room = room.reshape(shape)
    outside = room & _entered(beyond)
    grids = (unseen.reshape(-1, *shape), within.reshape(-1, *shape))
    return Floor(axis, axis, side, height, person, at, room, outside, *grids)


def _entered(beyond: Bool[np.ndarray, "X Y"]) -> Bool[np.ndarray, "X Y"]:
    """Return the squares at the edge of the grid, and those next to walkable ground beyond the
    areas."""
    from scipy.ndimage import binary_dilation

    edge = np.ones(beyond.shape, bool)
    edge[1:-1, 1:-1] = False
    beside: Bool[np.ndarray, "X Y"] = edge | binary_dilation(beyond, _AROUND)
    return beside


def _gaps(columns: Float[np.ndarray, "2 G 3"], m: Moments, moment: int) -> Float[np.ndarray, "G N"]:
    """Return the distance of each person's axis from the surface of each part of the robot, m."""
    start, end = m.start[moment][None], m.end[moment][None]
    distance = segment_to_segment(columns[0][:, None], columns[1][:, None], start, end)
    return np.asarray(distance - m.radius)


def _seen(
    scene: Scene,
    setup: Setup,
    m: Moments,
    moment: int,
    columns: Float[np.ndarray, "2 G 3"],
    radius: float,
    occlusion: Occlusion,
) -> Bool[np.ndarray, " G"]:
    """Return where a sensor sees a person at a moment."""
    size, bodies = np.array([radius]), tuple(o.body for o in scene.obstacles)
    count = ball_counts(np.linalg.norm(columns[1, :1] - columns[0, :1], axis=1), size, _ERROR)
    seen = np.zeros(columns.shape[1], bool)
    for first in range(0, len(seen), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        balls = balls_along(columns[0, part, None], columns[1, part, None], size, count)
        at = np.full(len(balls[0]), moment)
        seen[part] = seen_by(scene.robot, setup, m, at, balls, occlusion, bodies).any(axis=1)
    return seen


def floor_record(floor: Floor, of_moments: int) -> FloorRecord:
    """Return the areas of a floor, and the largest cylinder that stands unseen near the robot."""
    area, person = floor.side**2, floor.person
    radius, place = largest_unseen(floor)
    return FloorRecord(
        side_m=floor.side,
        x_m=_ends(floor.x, floor.side),
        y_m=_ends(floor.y, floor.side),
        floor_m=floor.height,
        stature_m=person.shoulder / SHOULDER,
        radius_m=person.radius,
        moments=len(floor.moments),
        of_moments=of_moments,
        room_m2=floor.room.sum() * area,
        near_m2=floor.near.sum() * area,
        never_seen_m2=floor.never_seen.sum() * area,
        at_times_unseen_m2=floor.at_times_unseen.sum() * area,
        near_unseen_m2=floor.near_unseen.sum() * area,
        access_m2=floor.access.sum() * area,
        possible_access_m2=floor.possible_access.sum() * area,
        largest_radius_m=radius,
        largest_at_m=place,
    )


def _ends(centres: Float[np.ndarray, " N"], side: float) -> tuple[float, float]:
    return float(centres[0] - side / 2), float(centres[-1] + side / 2)


def largest_unseen(floor: Floor) -> tuple[float, tuple[float, float]] | tuple[None, None]:
    """Return the radius, m, and the place (x, y), m, of the largest upright cylinder that stands
    unseen within the separation distance at some moment; None, None if none does.

    A cylinder of radius R is unseen if a person of radius r is at all places up to R - r from its
    axis.
    """
    from scipy.ndimage import distance_transform_edt

    best, place = -1.0, (0.0, 0.0)
    for unseen, within in zip(floor.unseen, floor.within, strict=True):
        clear = distance_transform_edt(np.pad(floor.room & unseen, 1))[1:-1, 1:-1]
        clear[~(floor.room & unseen & within)] = -1.0
        i, j = np.unravel_index(clear.argmax(), clear.shape)
        if clear[i, j] > best:
            best, place = float(clear[i, j]), (float(floor.x[i]), float(floor.y[j]))
    if best < 0:
        return None, None
    return floor.person.radius + (best - 1) * floor.side, place
