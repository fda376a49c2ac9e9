"""Shares of cubes: bounds that always hold, tight where one surface cuts."""

import math

import numpy as np
import pytest
from hypothesis import given
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import Spheres
from place_rings.coverage.solids.swept_tube import Tube
from place_rings.coverage.solids.tangent_bounds import share_under
from place_rings.coverage.solids.volume_fraction import VolumeFraction

from . import drawing

CUBE = np.stack(np.meshgrid(*[(np.arange(16) + 0.5) / 16 - 0.5] * 3, indexing="ij"), -1).reshape(
    -1, 3
)


def drawn_tube(rng):
    """Discs along a wandering line that may turn back sharply, so that discs cross."""
    n = int(rng.integers(2, 8))
    centre = np.cumsum(rng.normal(scale=0.1, size=(n, 3)), axis=0)
    normal = drawing.unit(rng, 1) + rng.choice([0.0, 0.3, 3.0]) * drawing.unit(rng, n)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Tube(centre, normal, float(rng.uniform(0.02, 0.4)), np.arange(n - 1))


def drawn_parts(rng):
    """Some cones, balls or slabs; some of them nearly the same."""
    kind = rng.integers(3)
    if kind == 2:
        return drawn_tube(rng)
    n = int(rng.integers(1, 5))
    if kind == 1:
        return Spheres(rng.uniform(-0.5, 0.5, (n, 3)), rng.uniform(0.01, 0.8, n))
    cones = drawing.cones(rng, n)
    twin = np.concatenate([np.arange(n), rng.integers(0, n, 1)])
    near = cones.apex[twin] + rng.choice([0.0, 1e-6, 1e-2]) * rng.normal(size=(n + 1, 3))
    return Cones(near, cones.axis[twin], cones.half_angle[twin], cones.range_m[twin])


def shares(parts, points, side):
    """Shares of cubes, each paired with every part that its ball does not prove away."""
    cell, index = (a.ravel() for a in np.indices((len(points), len(parts))))
    reach = math.sqrt(3) / 2 * side
    matters, inside = parts.decide(points[cell], cell, index, reach)
    known = np.zeros(len(points), bool)
    known[cell[inside]] = True
    found = parts.shares(
        points[cell[matters]], cell[matters], index[matters], len(points), side, 1e-12
    )
    return VolumeFraction(np.where(known, 1.0, found.low), np.where(known, 1.0, found.high))


@given(drawing.seeds)
def test_under_a_plane_is_the_share_of_many_points(seed):
    rng = np.random.default_rng(seed)
    normal = drawing.unit(rng, 40) * rng.choice([1.0, 1e-3, 0.0], (40, 3), p=[0.7, 0.2, 0.1])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0, normal / np.where(length > 0, length, 1), [[0.0, 0, 1]])
    value = rng.uniform(-0.9, 0.9, 40)
    share = share_under(value, value, normal)
    assert (share.high - share.low < 3e-4).all()
    assert (share.low >= 0).all()
    assert (share.high <= 1).all()
    p = rng.uniform(-0.5, 0.5, (20_000, 3))
    seen = (p @ normal.T + value <= 0).mean(axis=0)
    noise = math.sqrt(math.log(2 * 40 * 1e7) / (2 * len(p)))
    assert (share.low - noise <= seen).all()
    assert (share.high + noise >= seen).all()


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


@given(drawing.seeds)
def test_a_cube_holds_what_its_pieces_hold(seed):
    """Bounds of one cube against those of its 4096 pieces, which are tighter, and against
    points.
    """
    rng = np.random.default_rng(seed)
    parts, side = drawn_parts(rng), float(rng.choice([0.5, 0.1, 0.02]))
    away = np.array([[0.0, 0, 0]])
    on_surface = rng.uniform(-0.5, 0.5, (400, 3))
    centre = on_surface[[np.abs(parts(on_surface)).argmin()]] if rng.random() < 0.9 else away
    coarse = shares(parts, centre, side)
    fine = shares(parts, centre + side * CUBE, side / 16)
    assert (fine.low <= fine.high + 1e-15).all()
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


@given(drawing.seeds)
def test_one_smooth_surface_is_second_order(seed):
    """On a ball, a cone's mantle and a straight tube's, the width falls with the side, so what is
    open with its square.
    """
    rng = np.random.default_rng(seed)
    axis = drawing.unit(rng, 1)
    away = np.cross(axis, drawing.unit(rng, 1))
    away /= np.linalg.norm(away)
    half = float(rng.uniform(0.1, 1.2))
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
            assert found.high[0] - found.low[0] < 0.6 * bend * side
