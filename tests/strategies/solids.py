"""Beams and other solids."""

from typing import NamedTuple

import numpy as np
import trimesh
from hypothesis import strategies as st
from place_rings.coverage.cube_region import CubeRegion
from place_rings.coverage.robots.kinematics import transform
from place_rings.coverage.robots.pose_curve import pose_curve
from place_rings.coverage.solids.base import Difference, Intersection, Solid, Union
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.polyhedra import Polyhedron, box, hull
from place_rings.coverage.solids.pyramids import Pyramids
from place_rings.coverage.solids.sensor_beams import SHAPES, MixedBeams
from place_rings.coverage.solids.spheres import Spheres
from place_rings.coverage.solids.swept_tube import Tube
from scipy.spatial.transform import Rotation

from .units import FACINGS, TURNS, directions, metres, points_mm, ups


class Beam(NamedTuple):
    """A cone, or a pyramid where ``fov_up_deg`` is above 0."""

    apex_mm: tuple[int, int, int]
    facing_deg: tuple[int, int]
    """Azimuth and elevation of its axis."""
    fov_deg: int
    range_mm: int
    roll_deg: int
    """Turn of a pyramid about its axis."""
    fov_up_deg: int


def beam(
    apex_mm: tuple[int, int, int],
    facing_deg: tuple[int, int],
    fov_deg: int,
    range_mm: int,
    roll_deg: int = 0,
    fov_up_deg: int = 0,
) -> Beam:
    """A beam; Hypothesis prints this call, as it is shorter than the tuple."""
    return Beam(apex_mm, facing_deg, fov_deg, range_mm, roll_deg, fov_up_deg)


class capsule(NamedTuple):  # noqa: N801 - printed as the call that builds it
    """A capsule; a ball where its ends are equal."""

    start_mm: tuple[int, int, int]
    end_mm: tuple[int, int, int]
    radius_mm: int


class ball(NamedTuple):  # noqa: N801
    """A ball."""

    centre_mm: tuple[int, int, int]
    radius_mm: int


def cones(beams: list[Beam]) -> Cones:
    """The union of round beams."""
    apex, facing, fov, range_mm, *_ = zip(*beams, strict=True)
    return Cones(metres(apex), directions(facing), np.radians(fov) / 2, metres(range_mm))


def square_beams(apex, axis, half, range_m, up, half_up) -> MixedBeams:
    """Pyramids of several zones, and cones where ``half_up`` is 0."""
    square = half_up > 0
    which = tuple({Cones: ~square, Pyramids: square}.get(shape) for shape in SHAPES)
    return MixedBeams(apex, axis, half, range_m, up, half_up, None, which, None, square)


def mixed(cones: list[Beam], pyramids: list[Beam]) -> MixedBeams:
    """The union of beams of both shapes, the cones first; each pyramid has several zones."""
    apex, facing, fov, range_mm, roll, fov_up = zip(*cones, *pyramids, strict=True)
    return square_beams(
        metres(apex),
        directions(facing),
        np.radians(fov) / 2,
        metres(range_mm),
        ups(facing, roll),
        np.radians(fov_up) / 2,
    )


def capsules(each: list[capsule]) -> Capsules:
    """The union of capsules."""
    start, end, radius = zip(*each, strict=True)
    return Capsules(metres(start), metres(end), metres(radius))


def balls(each: list[ball]) -> Spheres:
    """The union of balls."""
    centre, radius = zip(*each, strict=True)
    return Spheres(metres(centre), metres(radius))


def turned_box(
    centre_mm: tuple[int, int, int],
    size_mm: tuple[int, int, int],
    turn_deg: tuple[int, int, int] = (0, 0, 0),
) -> Polyhedron:
    """A box of edges ``size_mm``, turned about x, y and z."""
    turn = Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix()
    return box(metres(centre_mm), metres(size_mm), turn)


def pointed(at_mm: tuple[int, int, int], corners_mm: list[tuple[int, int, int]]) -> Polyhedron:
    """The convex hull of a tetrahedron of edges of 100 mm and more corners, moved."""
    tetrahedron = 100 * np.eye(4, 3)
    return hull(metres(at_mm) + metres([*tetrahedron, *corners_mm]))


def tube(
    points_mm: list[tuple[int, int, int]],
    radius_mm: int,
    blend_percent: int = 50,
    points_per_bend: int = 5,
) -> Tube:
    """The tube swept about the curve through some points, no two neighbours equal."""
    return pose_curve(metres(points_mm), blend_percent / 100).tube(
        radius_mm / 1000, points_per_bend
    )


def some_cones(
    least: int = 1,
    most: int = 8,
    extent: int = 500,
    fov: tuple[int, int] = (1, 160),
    range_mm: tuple[int, int] = (100, 1500),
) -> st.SearchStrategy[Cones]:
    """From ``least`` to ``most`` cones of any width and range, narrow and wide ones among them."""
    each = st.builds(
        beam,
        apex_mm=points_mm(extent),
        facing_deg=FACINGS,
        fov_deg=st.integers(*fov),
        range_mm=st.integers(*range_mm),
    )
    return st.lists(each, min_size=least, max_size=most).map(cones)


def padded(cones: Cones, number: int) -> Cones:
    """The cones, made up to ``number`` with cones that see nothing: of range minus infinity."""
    spare = number - len(cones)
    ahead = np.tile([1.0, 0, 0], (spare, 1))
    blind = np.zeros((spare, 3)), ahead, np.full(spare, 0.2), np.full(spare, -np.inf)
    pairs = zip((cones.apex, cones.axis, cones.half_angle, cones.range_m), blind, strict=True)
    return Cones(*(np.concatenate(pair) for pair in pairs))


def some_beams(
    round_beams: int, pyramids: int, extent: int = 300, range_mm: tuple[int, int] = (300, 800)
) -> st.SearchStrategy[MixedBeams]:
    """So many cones, then so many pyramids."""

    def some(number: int, fov_up: st.SearchStrategy[int]) -> st.SearchStrategy[list[Beam]]:
        each = st.builds(
            beam,
            apex_mm=points_mm(extent),
            facing_deg=FACINGS,
            fov_deg=st.integers(12, 103),
            range_mm=st.integers(*range_mm),
            roll_deg=st.integers(-180, 180),
            fov_up_deg=fov_up,
        )
        return st.lists(each, min_size=number, max_size=number)

    return st.builds(
        mixed,
        cones=some(round_beams, st.just(0)),
        pyramids=some(pyramids, st.integers(12, 103)),
    )


def some_capsules(
    least: int,
    most: int,
    extent: int = 1000,
    radius_mm: tuple[int, int] = (50, 400),
) -> st.SearchStrategy[Capsules]:
    """Capsules with both ends in a cube about the origin, and balls."""
    each = st.builds(
        capsule,
        start_mm=points_mm(extent),
        end_mm=points_mm(extent),
        radius_mm=st.integers(*radius_mm),
    )
    return st.lists(each, min_size=least, max_size=most).map(capsules)


def some_balls(
    least: int = 1, most: int = 3, extent: int = 1000, radius_mm: tuple[int, int] = (100, 1000)
) -> st.SearchStrategy[Spheres]:
    """Balls with their centres in a cube about the origin."""
    each = st.builds(ball, centre_mm=points_mm(extent), radius_mm=st.integers(*radius_mm))
    return st.lists(each, min_size=least, max_size=most).map(balls)


def boxes(
    extent: int, size_mm: tuple[int, int], turned: bool = True
) -> st.SearchStrategy[Polyhedron]:
    """Boxes with their centres in a cube about the origin."""
    return st.builds(
        turned_box,
        centre_mm=points_mm(extent),
        size_mm=st.tuples(*[st.integers(*size_mm)] * 3),
        turn_deg=TURNS if turned else st.just((0, 0, 0)),
    )


def pointed_bodies(extent: int) -> st.SearchStrategy[Polyhedron]:
    """Pointed bodies about as large as the boxes of a cell."""
    corners = st.lists(points_mm(400), max_size=4)
    return st.builds(pointed, at_mm=points_mm(extent), corners_mm=corners)


def curve_points(least: int, most: int, extent: int = 1000) -> st.SearchStrategy[list]:
    """Points of which no two are equal, mm."""
    return st.lists(points_mm(extent), min_size=least, max_size=most, unique=True)


def some_tubes(
    least: int = 2,
    most: int = 6,
    radius_mm: tuple[int, int] = (100, 800),
    points_per_bend: int = 5,
) -> st.SearchStrategy[Tube]:
    """Tubes about curves through some points; bends may be so tight that discs cross."""
    return st.builds(
        tube,
        points_mm=curve_points(least, most),
        radius_mm=st.integers(*radius_mm),
        blend_percent=st.integers(10, 100),
        points_per_bend=st.just(points_per_bend),
    )


def some_solids(one_size: bool = False) -> st.SearchStrategy[Solid]:
    """Solids of each kind, and combinations of two of them.

    Args:
        one_size: each kind has the same number of parts in all examples, as JAX compiles for each.
    """
    beams = some_cones(4 if one_size else 1, 4)
    round_ones = some_balls(3 if one_size else 1, 3)
    swept = some_tubes(4, 4) if one_size else some_tubes()
    return st.one_of(
        beams,
        round_ones,
        swept,
        st.builds(Union, beams, round_ones),
        st.builds(Intersection, round_ones, swept),
        st.builds(Difference, swept, beams),
    )


def some_mesh(
    kind: str, size_mm: tuple[int, ...], turn: tuple[int, ...], seed: int
) -> trimesh.Trimesh:
    """A closed mesh."""
    a, b, c = np.array(size_mm) / 1000
    mesh = {
        "box": lambda: trimesh.creation.box((a, b, c)),
        "ball": lambda: trimesh.creation.icosphere(2, a),
        "ring": lambda: trimesh.creation.torus(0.6, 0.1 + b / 10, 24, 12),
        "can": lambda: trimesh.creation.cylinder(a / 2, b, sections=16),
        "two": lambda: trimesh.util.concatenate(
            [
                trimesh.creation.box((0.2, 0.3, c)),
                trimesh.creation.icosphere(1, 0.2).apply_translation((0.9, 0, 0)),
            ]
        ),
    }[kind]()
    mesh.apply_transform(transform(np.zeros(3), np.radians(turn)))
    if kind == "ball":  # dents, so that it is not convex
        mesh.vertices *= 1 + 0.2 * np.random.default_rng(seed).random((len(mesh.vertices), 1))
    return mesh


MESHES = st.builds(
    some_mesh,
    st.sampled_from(["box", "ball", "ring", "can", "two"]),
    st.tuples(*[st.integers(200, 1000)] * 3),
    st.tuples(*[st.sampled_from([0, 0, 30, 90])] * 3),
    st.integers(0, 99),
)


def some_region(
    seed: int, shape: tuple[int, ...], share: int, corner: tuple[int, ...]
) -> CubeRegion:
    """Cubes of 0.1 m, about ``share`` tenths of an array."""
    inside = np.random.default_rng(seed).random(shape) < share / 10
    return CubeRegion(inside, np.array(corner), 0.1)


REGIONS = st.builds(
    some_region,
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.integers(1, 6)] * 3),
    st.integers(1, 10),
    st.tuples(*[st.integers(-5, 5)] * 3),
)
