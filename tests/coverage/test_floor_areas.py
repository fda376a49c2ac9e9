"""Areas of a floor plan as a weight field, held against polygons of matplotlib, against the closed
form of areas, and against a box."""

import math

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.path import Path
from place_rings.coverage.floor_areas import area_shares, in_areas

from ..support.refusals import refused

coordinate = st.integers(-30, 30).map(lambda n: n / 10)
stars = st.lists(st.integers(2, 20), min_size=3, max_size=9).map(
    lambda radii: [
        (r / 10 * math.cos(a), r / 10 * math.sin(a))
        for r, a in zip(radii, 2 * math.pi * np.arange(len(radii)) / len(radii), strict=True)
    ]
)


def area_of(polygon):
    x, y = np.array(polygon).T
    return abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


@given(star=stars, seed=st.integers(0, 99))
def test_places_lie_in_a_polygon_as_matplotlib_finds(star, seed):
    points = np.random.default_rng(seed).uniform(-2.1, 2.1, (300, 2))
    np.testing.assert_array_equal(in_areas(*points.T, [star]), Path(star).contains_points(points))


@given(star=stars)
def test_shares_add_up_to_the_area(star):
    shares, low, cell = area_shares([star], 0.05, 200_000)
    around = sum(math.dist(a, b) for a, b in zip(star, (*star[1:], star[0]), strict=True))
    assert abs(shares.sum() * cell[0] * cell[1] - area_of(star)) <= 0.05 * around / 4
    assert ((shares >= 0) & (shares <= 1)).all()
    np.testing.assert_allclose(low, np.min(star, axis=0), atol=1e-12)


@given(
    corner=st.tuples(coordinate, coordinate),
    size=st.tuples(*[st.integers(1, 30).map(lambda n: n / 10)] * 2),
    most=st.integers(100, 5000),
)
def test_a_rectangle_fills_its_cells_within_their_number(corner, size, most):
    (x, y), (a, b) = corner, size
    shares, _, cell = area_shares([[(x, y), (x + a, y), (x + a, y + b), (x, y + b)]], 0.05, most)
    assert (shares == 1).all()
    assert shares.size <= most
    np.testing.assert_allclose(np.array(shares.shape) * cell, size)


def test_a_plan_in_one_line_weighs_as_the_box_above_it_counts():
    plan = {"areas": [[(0.4, -1), (1.2, -1), (1.2, 1), (0.4, 1)]], "heights": (0, 1.2)}
    weighted = pr.Scene(targets=pr.Near(1.0, importance=plan))
    box = pr.Box((0.8, 2, 1.2), centre=(0.8, 0, 0.6))
    cut = pr.Scene(targets=pr.IntersectionOf([pr.Near(1.0), box], name="plan"))
    both = [pr.verify("n2_16_25", s, voxel=0.04).records[0].zeta for s in (weighted, cut)]
    assert both[0] == pytest.approx(both[1], abs=1e-9)


def test_a_plan_is_stated_whole():
    area = [[(0, 0), (1, 0), (0, 1)]]
    for wrong, key in (
        ({"areas": area}, "heights"),
        ({"areas": area, "heights": (1, 1)}, "heights"),
        ({"areas": area, "heights": (0, 1), "cell": (1, 1, 1)}, "cell"),
        ({"areas": [[(0, 0), (1, 0)]], "heights": (0, 1)}, "areas"),
        ({"areas": [[(0, 0), (1, 0), (2, 0)]], "heights": (0, 1)}, "areas"),
        ({"rows": ["1"], "origin": (0, 0, 0)}, "cell"),
        ({"rows": ["1"], "origin": (0, 0, 0), "cell": (1, 1, 1), "heights": (0, 1)}, "heights"),
    ):
        with refused(error=pr.InputError) as caught:
            pr.Near(1.0, importance=wrong)
        assert key in str(caught.value)
