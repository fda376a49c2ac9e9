"""Shares of cubes: bounds that always hold, tight where one surface cuts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.solids.base import CubePairs
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.parabolic_segments import segment_share
from place_rings.coverage.solids.spheres import Spheres
from place_rings.coverage.solids.swept_tube import Tube
from place_rings.coverage.solids.tangent_bounds import share_under
from place_rings.coverage.solids.volume_fraction import VolumeFraction

from ..strategies.solids import Beam, beam, cones, some_balls
from ..strategies.units import (
    FACINGS,
    GENERATORS,
    directions,
    metres,
    points_mm,
    ups,
)

CUBE = np.stack(np.meshgrid(*[(np.arange(16) + 0.5) / 16 - 0.5] * 3, indexing="ij"), -1).reshape(
    -1, 3
)


def wandering_tube(
    steps_mm: list[tuple[int, int, int]],
    facing_deg: tuple[int, int],
    wobble: float,
    wobbles_deg: list[tuple[int, int]],
    radius_mm: int,
) -> Tube:
    """Discs along a line that may turn back sharply, so that discs cross. They face one way, and
    each another as far as ``wobble`` says.
    """
    n = len(steps_mm) + 1
    centre = np.cumsum([[0.0, 0, 0], *metres(steps_mm)], axis=0)
    normal = directions([facing_deg]) + wobble * directions(wobbles_deg[:n])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-9, normal / np.maximum(length, 1e-9), directions([facing_deg]))
    return Tube(centre, normal, radius_mm / 1000, np.arange(n - 1))


def nearly_twice(beams: list[Beam], again: int, apart: float) -> Cones:
    """A union of cones, one of which is there again, ``apart`` m beside."""
    parts = cones([*beams, beams[again % len(beams)]])
    parts.apex[-1] += apart
    return parts


CONE = st.builds(beam, points_mm(500), FACINGS, st.integers(1, 160), st.integers(100, 1500))
PARTS = st.one_of(
    st.builds(
        nearly_twice,
        st.lists(CONE, min_size=1, max_size=4),
        st.integers(0, 3),
        st.sampled_from([0.0, 1e-6, 1e-2]),
    ),
    some_balls(1, 4, 500, (10, 800)),
    st.builds(
        lambda ends_mm, radius_mm: Capsules(
            *np.split(metres(ends_mm), 2), np.full(2, radius_mm / 1e3)
        ),
        st.lists(points_mm(500), min_size=4, max_size=4),
        st.integers(10, 800),
    ),
    st.builds(
        wandering_tube,
        steps_mm=st.lists(points_mm(200).filter(any), min_size=1, max_size=6),
        facing_deg=FACINGS,
        wobble=st.sampled_from([0.0, 0.3, 3.0]),
        wobbles_deg=st.lists(FACINGS, min_size=7, max_size=7),
        radius_mm=st.integers(20, 400),
    ),
)
SIDES_MM = st.sampled_from([500, 100, 20])


def shares(parts, points, side, curved=True):
    """Shares of cubes, each paired with every part that its ball does not prove away."""
    cell, index = (a.ravel() for a in np.indices((len(points), len(parts))))
    reach = math.sqrt(3) / 2 * side
    matters, inside = parts.decide(points[cell], cell, index, reach)
    known = np.zeros(len(points), bool)
    known[cell[inside]] = True
    pairs = CubePairs(points[cell], cell, index, len(points), side, 1e-12, curved)
    found = parts.shares(pairs.only(np.flatnonzero(matters)))
    return VolumeFraction(np.where(known, 1.0, found.low), np.where(known, 1.0, found.high))


LINES = [a.ravel() for a in np.meshgrid(*[(np.arange(400) + 0.5) / 400 - 0.5] * 2)]
SCALES = st.tuples(*[st.sampled_from([1.0, 1.0, 1e-3, 0.0])] * 3)
PLANES = st.lists(st.tuples(FACINGS, SCALES, st.integers(-90, 90)), min_size=1, max_size=40)


@given(PLANES, GENERATORS)
def test_under_a_plane_is_the_share_of_many_points(planes, rng):
    """Some planes are nearly along an axis or two, by the scales of their normals."""
    facing, scale, percent = zip(*planes, strict=True)
    normal, value = directions(facing) * scale, np.array(percent) / 100
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-9, normal / np.maximum(length, 1e-9), [[0.0, 0, 1]])
    share = share_under(value, value, normal)
    assert (share.high - share.low < 3e-4).all()
    assert (share.low >= 0).all()
    assert (share.high <= 1).all()
    p = rng.uniform(-0.5, 0.5, (20_000, 3))
    seen = (p @ normal.T + value <= 0).mean(axis=0)
    noise = math.sqrt(math.log(2 * 40 * 1e7) / (2 * len(p)))
    assert (share.low - noise <= seen).all()
    assert (share.high + noise >= seen).all()


@given(
    facing_deg=FACINGS,
    scale=SCALES,
    turn_deg=st.integers(-180, 180),
    percent=st.integers(-90, 90),
    bend=st.sampled_from([1, 20, 300, 800]),
    least=st.integers(0, 100),
    twice=st.booleans(),
)
def test_between_a_plane_and_a_parabola_is_the_share_of_many_lines(
    facing_deg, scale, turn_deg, percent, bend, least, twice
):
    """Lines along the axis nearest to the normal; a parabola excludes what lies between two roots
    of each."""
    normal, value = directions([facing_deg])[0] * scale, percent / 100
    normal = normal / np.linalg.norm(normal) if normal.any() else np.array([0.0, 0, 1])
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    turn = math.radians(turn_deg)
    first = math.cos(turn) * first + math.sin(turn) * np.cross(normal, first)
    along = np.stack([first, np.cross(normal, first) * twice])
    bends = bend / 1000 * np.array([least / 100, 1.0])
    share = segment_share(
        np.array([value]),
        normal[None],
        along[:, None],
        VolumeFraction(bends[:1], bends[1:]),
        1e-12,
    )
    k = int(np.abs(normal).argmax())
    start = np.insert(np.stack(LINES, -1), k, 0.0, axis=-1)  # (M, 3), in the middle plane
    g, t = start @ normal + value, start @ along.T
    seen = []
    for b in bends:
        # g <= 0 < g + b t^2 / 2 at start + x, where both change linearly with x
        a = b / 2 * (along[:, k] ** 2).sum()
        half = (normal[k] + b * t @ along[:, k]) / 2
        c = g + b / 2 * (t * t).sum(-1)
        root = np.sqrt(np.maximum(half * half - a * c, 0.0))
        sign = np.where(half < 0, -1.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.stack([-(half + sign * root) / a, -c / (half + sign * root)])
        x = np.sort(np.nan_to_num(x, posinf=9, neginf=-9), axis=0)
        x = np.where(half * half < a * c, 0.0, x)
        end = np.clip(-g / normal[k], -0.5, 0.5)
        ends = (-0.5, end) if normal[k] > 0 else (end, 0.5)
        inside = np.clip(x, *ends)
        seen.append((ends[1] - ends[0] - (inside[1] - inside[0])).mean())
    assert share.low[0] - 6e-4 * bends[0] <= seen[0] <= seen[1] <= share.high[0] + 6e-4 * bends[1]


@pytest.mark.parametrize(
    ("normal", "value", "share"),
    [
        ([1, 0, 0], -0.25, 0.75),
        ([0, 0, -1], 0.25, 0.25),
        ([1, 1, 0], 0.0, 0.5),
        ([1, 1, 0], 0.5, 0.125),
        ([1, 1, 1], 1.0, 1 / 48),
        ([-1, 1, 1], -1.0, 47 / 48),
        ([1, -1, 1], 0.0, 0.5),
        ([1, 2, 3], 3.1, 0.0),
        ([1, 2, 3], -3.1, 1.0),
    ],
)
def test_under_a_plane_closed_forms(normal, value, share):
    length = math.sqrt(sum(v * v for v in normal))
    found = share_under(
        np.array([value / length]), np.array([value / length]), np.array([normal], float) / length
    )
    assert found.low[0] <= share + 1e-12
    assert found.high[0] >= share - 1e-12
    assert found.high[0] - found.low[0] < 2e-4


@settings(max_examples=20)
@given(PARTS, SIDES_MM, GENERATORS)
def test_a_cube_holds_what_its_pieces_hold(parts, side_mm, rng):
    """Bounds of one cube against those of its 4096 pieces, which are tighter, and against
    points. The cube is about the origin, or near a surface.
    """
    side = side_mm / 1000
    near = rng.uniform(-0.5, 0.5, (400, 3))
    away = rng.random() < 0.1
    centre = np.zeros((1, 3)) if away else near[[np.abs(parts(near)).argmin()]]
    coarse = shares(parts, centre, side)
    fine = shares(parts, centre + side * CUBE, side / 16)
    assert (fine.low <= fine.high + 1e-15).all()
    planes = shares(parts, centre, side, curved=False)
    assert planes.low[0] - 1e-12 <= coarse.low[0] <= coarse.high[0] <= planes.high[0] + 1e-12
    assert coarse.low[0] <= fine.high.mean() + 1e-12
    assert coarse.high[0] >= fine.low.mean() - 1e-12
    p = centre + side * rng.uniform(-0.5, 0.5, (20_000, 3))
    noise = math.sqrt(math.log(2e7) / (2 * len(p)))
    seen = float((parts(p) <= 0).mean())
    assert fine.low.mean() - noise <= seen <= fine.high.mean() + noise


@pytest.mark.parametrize("kind", ["cone", "tube"])
def test_a_cube_about_an_axis(kind):
    """The way from the axis to the cube's centre is rounding alone there, and may point along the
    axis.
    """
    rng = np.random.default_rng(3)
    p = rng.uniform(-0.5, 0.5, (20_000, 3))
    noise = math.sqrt(math.log(2 * 300 * 1e3) / (2 * len(p)))
    for _ in range(300):
        axis = rng.choice([-1.0, 1.0], (1, 3)) if rng.random() < 0.3 else rng.normal(size=(1, 3))
        axis /= np.linalg.norm(axis)
        if kind == "cone":
            apex, half = -rng.uniform(0.5, 1.0) * axis, rng.uniform(0.6, 1.2, 1)
            parts = Cones(apex, axis, half, np.array([5.0]))
        else:
            ends = np.concatenate([-rng.uniform(0.3, 1.2) * axis, rng.uniform(0.3, 1.2) * axis])
            parts = Tube(
                ends, np.repeat(axis, 2, axis=0), float(rng.uniform(0.7, 0.86)), np.array([0])
            )
        share = shares(parts, np.zeros((1, 3)), 1.0)
        seen = float((parts(p) <= 0).mean())
        assert share.low[0] - noise <= seen <= share.high[0] + noise


@given(FACINGS, st.integers(-180, 180), st.integers(6, 69))
def test_one_smooth_surface_is_second_order(facing_deg, roll_deg, half_deg):
    """On a ball, a cone's mantle and a straight tube's, the width falls with the square of the
    side.
    """
    axis, away = directions([facing_deg]), ups([facing_deg], [roll_deg])
    half = math.radians(half_deg)
    on_cone = axis * 0.5 * math.cos(half) + away * 0.5 * math.sin(half)
    solids = [
        (Spheres(np.zeros((1, 3)), np.array([0.5])), 0.5 * away, 2.0),
        (
            Cones(np.zeros((1, 3)), axis, np.array([half]), np.array([2.0])),
            on_cone,
            1 / (0.5 * math.tan(half)),
        ),
        (
            Tube(np.concatenate([-axis, axis]), np.concatenate([axis, axis]), 0.3, np.array([0])),
            0.3 * away,
            1 / 0.3,
        ),
    ]
    for parts, point, bend in solids:
        for side in (0.02, 0.01, 0.005):
            found = shares(parts, point, side)
            assert found.high[0] - found.low[0] < min(0.6, 3 * bend * side) * bend * side
