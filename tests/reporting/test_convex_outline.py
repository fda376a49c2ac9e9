"""Convex hulls in the plane against SciPy's, and degenerate ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.reporting.rendering.convex_outline import convex_outline
from scipy.spatial import ConvexHull


def _area(corners):
    x, y = corners.T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(3, 60), lattice=st.booleans())
def test_the_outline_is_that_of_qhull(seed, count, lattice):
    points = np.random.default_rng(seed).normal(size=(count, 2))
    if lattice:  # equal points, and points on edges
        points = np.rint(2 * points)
        points = np.concatenate([points, [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]]])
    wanted = ConvexHull(points)
    corners = points[convex_outline(points)]
    assert {*map(tuple, corners)} == {*map(tuple, points[wanted.vertices])}
    assert _area(corners) == pytest.approx(wanted.volume)  # anti-clockwise, once around


def test_points_on_a_line_give_its_ends():
    points = np.outer([0.5, 0.0, 1.0, 0.25, 1.0], [1.0, 2.0])
    assert {*map(tuple, points[convex_outline(points)])} == {(0.0, 0.0), (1.0, 2.0)}


def test_equal_points_give_one():
    assert len(convex_outline(np.ones((4, 2)))) == 1
