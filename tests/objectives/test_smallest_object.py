"""The largest unseen objects: against brute force that shares no code, closed forms and laws."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import Spheres, sphere
from place_rings.coverage.targets.named import Near
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels.largest_object import largest_object
from place_rings.coverage.voxels.object_map import ObjectMap, places
from place_rings.coverage.voxels.object_room import BALL, NOTHING, ObjectShape, UnseenSpace
from place_rings.objectives.gap_map import KEYS, GapMap
from place_rings.objectives.scene import Scene
from place_rings.objectives.smallest_object import smallest_object, zone_rays
from place_rings.reporting.setup_report.smallest_object_section import object_table
from scipy.spatial import cKDTree

WIDTH, ROD, MOST = 0.001, 0.2, 0.25

FINE = 0.0005  # m, to which places are rounded horizontally for a rod


def grid_of(target, seen, bodies=NOTHING, side=0.02, **terms):
    return UnseenSpace.about(target, bodies, seen, side, 5, MOST, ROD, **terms).grid(5)


def bounds_in(target, seen, shape, bodies=NOTHING, **terms):
    return largest_object(grid_of(target, seen, bodies, **terms), shape, WIDTH)


def drawn_cones(rng, count):
    """Cones about a ball of radius 0.25 m at the origin, most of which look into it."""
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    apex = -rng.uniform(0.1, 0.4, (count, 1)) * axis + rng.normal(0, 0.08, (count, 3))
    return Cones(apex, axis, rng.uniform(0.1, 0.5, count), rng.uniform(0.1, 0.6, count))


@dataclass(frozen=True)
class Drawn:
    """A setup that brute force examines by plain formulas: cones, a ball that stands in the beams,
    and a target, which is a ball at the origin or all places near to the ball."""

    cones: Cones
    body: np.ndarray
    radius: float
    near: bool
    reach: float
    spacing: float  # m, of the places on surfaces that brute force examines

    @classmethod
    def of(cls, seed, spacing):
        rng = np.random.default_rng(seed)
        near = bool(seed % 2)
        reach = rng.uniform(0.06, 0.15) if near else rng.uniform(0.1, 0.2)
        cones, body = drawn_cones(rng, 8), rng.normal(0, 0.12, 3)
        return cls(cones, body, rng.uniform(0.03, 0.06), near, reach, spacing)

    @property
    def bodies(self):
        return Capsules(self.body[None], self.body[None], np.array([self.radius]))

    def grid(self):
        """The product's cells."""
        target = sphere(np.zeros(3), self.reach)
        if self.near:
            target = sphere(self.body, self.radius + self.reach)
        seen = beams(self.cones, Occluders(self.bodies), "shadow")
        place = Difference(target, self.bodies)
        return grid_of(place, seen, self.bodies, most_ball=self.reach if self.near else np.inf)

    def is_place(self, points):
        gap = np.linalg.norm(points - self.body, axis=1) - self.radius
        if self.near:
            return (gap >= 0) & (gap <= self.reach)
        return (gap >= 0) & (np.linalg.norm(points, axis=1) <= self.reach)

    def seen_by(self, points, k):
        """Which points cone k holds and the ball does not hide: the segment from the apex misses
        it."""
        apex, axis, half, length = (
            getattr(self.cones, key)[k] for key in ("apex", "axis", "half_angle", "range_m")
        )
        if np.linalg.norm(apex - self.body) <= self.radius:
            return np.zeros(len(points), bool)
        v = points - apex
        d = v @ axis
        square = (v * v).sum(axis=1)
        inside = (d >= 0) & (d <= length + 1e-12)
        inside &= square - d * d <= (d * np.tan(half)) ** 2 + 1e-12
        t = np.clip((self.body - apex) @ v.T / np.maximum(square, 1e-12), 0, 1)
        gap = np.linalg.norm(apex + t[:, None] * v - self.body, axis=1)
        return inside & (gap > self.radius)

    def surface(self, k):
        """Points on the side and the base of cone k, and on the edge of the ball's shadow."""
        apex, axis, half, length = (
            getattr(self.cones, key)[k] for key in ("apex", "axis", "half_angle", "range_m")
        )
        wide = length * np.tan(half)
        points = [
            apex + d * axis + rho * ring(axis, rho, self.spacing)
            for d in np.arange(0, length, self.spacing / 2)
            for rho in [d * np.tan(half)]
        ]
        points += [
            apex + length * axis + rho * ring(axis, rho, self.spacing)
            for rho in spaced(wide, self.spacing)
        ]
        way = self.body - apex
        far = np.linalg.norm(way)
        if far > self.radius:
            graze = np.arcsin(self.radius / far) + 1e-7
            points += [
                apex
                + s
                * (np.cos(graze) * way / far + np.sin(graze) * ring(way / far, rho, self.spacing))
                for s in spaced(length / np.cos(half), self.spacing)
                for rho in [s * np.sin(graze)]
            ]
        return np.concatenate(points)

    def walls(self):
        """Points that no object may hold, dense on all surfaces, and three times coarser within."""
        reach = MOST + self.reach + (np.linalg.norm(self.body) + self.radius if self.near else 0)
        axis = np.arange(-reach, reach, 3 * self.spacing)
        points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
        each = [self.body + self.radius * fibonacci(self.radius, self.spacing)]
        for k in range(len(self.cones)):
            some = np.concatenate([points, self.surface(k)])
            each.append(some[self.seen_by(some, k)])
        return np.concatenate(each)

    def places(self, step):
        """Unseen places of the target on a grid."""
        reach = self.reach + (np.linalg.norm(self.body) + self.radius if self.near else 0)
        axis = np.arange(-reach, reach + step, step)
        points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
        points = points[self.is_place(points)]
        for k in range(len(self.cones)):
            points = points[~self.seen_by(points, k)]
        return points


def spaced(length, spacing):
    return np.linspace(0, length, int(np.ceil(length / spacing)) + 1)


def ring(axis, radius, spacing):
    """Unit vectors across an axis, at most so far apart on a circle of a radius."""
    count = int(np.ceil(2 * np.pi * radius / spacing)) + 1
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
    return np.cos(turn) * side + np.sin(turn) * np.cross(axis, side)


def fibonacci(radius, spacing):
    """Unit vectors about so far apart on a sphere of a radius."""
    count = int(4 * np.pi * radius**2 / spacing**2) + 1
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)


def brute_room(walls, centres, length):
    """The radius of the largest object about each centre that holds no wall."""
    if length is None:
        return cKDTree(walls).query(centres)[0]
    room = np.full(len(centres), np.inf)
    for z in np.unique(centres[:, 2]):
        layer = centres[:, 2] == z
        flat = walls[np.abs(walls[:, 2] - z) <= length / 2, :2]
        if len(flat):
            x, y = np.round(flat / FINE).astype(int).T  # a table of squares drops what is double
            table = np.zeros((np.ptp(x) + 1, np.ptp(y) + 1), bool)
            table[x - x.min(), y - y.min()] = True
            flat = FINE * (np.argwhere(table) + np.array([x.min(), y.min()]))
            room[layer] = cKDTree(flat).query(centres[layer, :2])[0] + FINE
    return room


def held_against_brute_force(seed, step, spacing):
    """Bounds of the largest sphere and rod of a drawn setup, and what brute force finds, m."""
    drawn = Drawn.of(seed, spacing)
    walls, places, grid = drawn.walls(), drawn.places(step), drawn.grid()
    rows = []
    for length in (None, ROD):
        b = largest_object(grid, ObjectShape(length), WIDTH)
        brute = min(float(brute_room(walls, places, length).max(initial=0.0)), MOST)
        rows.append((b.low, brute, b.high))
        assert brute <= b.high + spacing  # walls are about so far apart
        if length is None:  # the room of a ball never changes faster than distance
            assert b.low <= brute + np.sqrt(3) * step
        if b.centre is not None:  # nothing blocked lies in the object that was found
            assert drawn.is_place(b.centre[None]).all()
            v = walls - b.centre
            aside = np.linalg.norm(v if length is None else v[:, :2], axis=1)
            within = np.abs(v[:, 2]) < (np.inf if length is None else length / 2)
            assert not ((aside < b.low - 1e-9) & within).any()
    return rows


@pytest.mark.parametrize("seed", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_bounds_hold_against_objects_on_a_grid(seed):
    held_against_brute_force(seed, 0.02, 0.01)


@pytest.mark.parametrize("seed", range(2))
def test_a_map_bounds_the_room_of_each_place(seed):
    drawn = Drawn.of(seed, 0.01)
    walls, grid = drawn.walls(), drawn.grid()
    centres = places(grid)
    assert len(centres) > 0
    assert drawn.is_place(centres).all()
    for length in (None, ROD):
        low, high = ObjectMap.of(grid).room(centres, ObjectShape(length))
        assert (low <= high).all()
        brute = brute_room(walls, centres, length)
        assert (low <= brute + 1e-9).all()
        if length is None:
            for k in range(len(drawn.cones)):
                brute[drawn.seen_by(centres, k)] = 0
            assert (np.minimum(brute, grid.space.limit(BALL)) <= high + drawn.spacing).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_bounds_hold_against_objects_on_a_fine_grid(seed):
    for low, _, high in held_against_brute_force(seed, 0.008, 0.004):
        assert high - low <= 0.02


BOTH = pytest.mark.parametrize("shape", [BALL, ObjectShape(ROD)])


@BOTH
@pytest.mark.parametrize(("seen", "away", "target"), [(0.05, 0.15, 0.04), (0.02, 0.1, 0.08)])
def test_beside_a_seen_ball_the_farthest_place_of_a_ball_has_the_most_room(
    shape, seen, away, target
):
    b = bounds_in(sphere(np.array([away, 0, 0]), target), sphere(np.zeros(3), seen), shape)
    assert b.low <= away + target - seen <= b.high
    assert b.high - b.low <= 0.01


@BOTH
def test_an_object_may_stick_out_of_its_target(shape):
    """Between two balls, a small target about the middle; its places beside the line between them
    have the most room."""
    balls = Spheres(np.array([[0.1, 0, 0], [-0.1, 0, 0]]), np.array([0.03, 0.03]))
    for seen, bodies in ((balls, NOTHING), (NOTHING, balls)):
        b = bounds_in(sphere(np.zeros(3), 0.02), seen, shape, bodies)
        assert b.low <= np.hypot(0.1, 0.02) - 0.03 <= b.high
        assert b.high - b.low <= 0.01


@BOTH
def test_where_nothing_is_seen_objects_are_told_apart_up_to_the_limit(shape):
    b = bounds_in(sphere(np.zeros(3), 0.1), NOTHING, shape)
    assert b.low == b.high == MOST


def test_where_all_is_seen_no_object_is_left():
    b = bounds_in(sphere(np.zeros(3), 0.3), sphere(np.zeros(3), 0.5), BALL)
    assert (b.low, b.high, b.centre) == (0.0, 0.0, None)


@pytest.mark.slow
def test_more_sensors_and_longer_ranges_leave_no_larger_object():
    rng = np.random.default_rng(5)
    cones, target = drawn_cones(rng, 6), sphere(np.zeros(3), 0.25)
    fewer = Cones(cones.apex[:3], cones.axis[:3], cones.half_angle[:3], cones.range_m[:3])
    longer = replace(cones, range_m=1.5 * cones.range_m)
    for shape in (BALL, ObjectShape(ROD)):
        each = [bounds_in(target, seen, shape) for seen in (fewer, cones, longer)]
        for a, b in pairwise(each):
            assert b.low <= a.high


def test_a_rod_is_no_shorter_than_a_cell():
    with pytest.raises(ValueError, match="not longer than cells"):
        bounds_in(sphere(np.zeros(3), 0.3), NOTHING, ObjectShape(0.01))


@pytest.mark.slow
def test_a_scene_has_its_verdict_and_its_point_density():
    """A box that no sensor reaches has the largest gap; near the arm it is the target's own."""
    box = Box((0.2, 0.2, 0.4), (2.5, 2.5, 1.0), name="box", largest_gap=0.19)
    scene, setup = Scene(targets=(box,)), named_setup("n1_8_0")
    r = smallest_object(scene, setup, box, 0.02, 0.3)
    assert r.sphere.low == r.sphere.high == r.rod.low == r.rod.high == 1.0
    assert (r.verdict, r.zones_per_m3) == ("fail", 0)
    for gap, verdict in ((0.09, "fail"), (0.1, "pass")):
        near = Near(0.05, largest_gap=gap)
        r = smallest_object(Scene(targets=(near,)), setup, near, 0.02, 0.3)
        assert (r.verdict, r.sphere.high <= 0.1) == (verdict, True)


def test_a_target_thinner_than_the_first_cells_is_examined_like_any_other():
    """Its point density is that of the voxels of a count, and its map may have no place."""
    thin = Box((0.2, 0.2, 0.005), (2.5, 2.5, 1.0), name="thin", largest_gap=0.19)
    scene, setup = Scene(targets=(thin,)), named_setup("n1_4_0")
    r = smallest_object(scene, setup, thin, 0.002, 0.3)
    assert (r.verdict, r.zones_per_m3) == ("fail", 0)
    gaps = GapMap.of(scene, setup, thin, 0, 0.02, 0.3)
    assert object_table([gaps]).splitlines() == [",".join(KEYS), *map(str, gaps.rows())]


@pytest.mark.parametrize("name", ["vl53l9cx-precision", "vl53l5cx", "vl53l1x"])
def test_each_zone_has_a_ray_in_its_own_part_of_the_beam(name):
    sensor = effective(Use(name)).sensor
    setup = Setup((Ring("tool", 0.0, 1, radius=0.2, sensor=sensor),))
    scene = Scene(occlusion="ignore")
    cones = sensor_cones(scene.robot, setup, scene.poses[0].q)
    way = zone_rays(scene, setup, 0)[:, -1] - cones.apex[0]
    depth = way @ cones.axis[0]
    sides = zip(cones.sides(0), (sensor.half_angle, sensor.half_angle_up), strict=True)
    places = [way @ side / depth / max(np.tan(half), 1e-9) for side, half in sides]
    zone = [
        np.floor((p + 1) / 2 * n) for p, n in zip(places, (sensor.zones, sensor.rows), strict=True)
    ]
    assert len(way) == sensor.zones * sensor.rows
    assert set(zip(*zone, strict=True)) == set(np.ndindex(sensor.zones, sensor.rows))


@pytest.mark.slow
def test_near_the_arm_no_start_contradicts_another():
    """The bounds from coarse and from fine cells hold the same truth, and a rod holds a sphere of
    its width or length."""
    target = Near(0.1)
    scene, setup = Scene(targets=(target,)), named_setup("n2_16_25")
    a, b = (smallest_object(scene, setup, target, side, 0.3) for side in (0.05, 0.03))
    for shape in ("sphere", "rod"):
        one, other = getattr(a, shape), getattr(b, shape)
        assert max(one.low, other.low) <= min(one.high, other.high)
    assert min(a.rod.low, 0.3) <= a.sphere.high
    assert a.zones_per_m3 > 0
