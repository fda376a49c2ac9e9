"""The nearest point on a segment, for NumPy and JAX alike, and the capsules made of it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.capsules import Capsules, gap_to_capsules
from place_rings.coverage.solids.segments import from_segment, point_to_segment

from ..strategies.solids import some_capsules
from ..strategies.units import GENERATORS, failures, metres, points_mm


@settings(max_examples=15)
@given(points_mm(1000), points_mm(1000), GENERATORS)
def test_no_point_of_a_segment_is_nearer_than_the_nearest(start_mm, end_mm, rng):
    start, end, points = metres([start_mm]), metres([end_mm]), rng.uniform(-1, 1, (40, 3))
    way = from_segment(points, start, end)
    share = np.linspace(0, 1, 2001)[:, None, None]
    dense = np.linalg.norm(points - (start + share * (end - start)), axis=2).min(axis=0)
    length = np.linalg.norm(way, axis=1)
    assert failures(points, length <= dense + 1e-12) == []
    # Two neighbouring ones of the dense points are at most half a thousandth of a length apart.
    apart = np.linalg.norm(end - start) / 4000
    assert failures(points, length >= dense - apart - 1e-12) == []
    np.testing.assert_allclose(point_to_segment(points, start, end), length, rtol=1e-14)
    with jax.numpy_rank_promotion("allow"):
        of_jax = from_segment(*(jnp.asarray(a) for a in (points, start, end)))
    np.testing.assert_allclose(of_jax, way, atol=1e-14)


@given(points_mm(1000), GENERATORS)
def test_a_segment_of_no_length_is_a_point(place_mm, rng):
    place, points = metres([place_mm]), rng.uniform(-1, 1, (40, 3))
    np.testing.assert_array_equal(from_segment(points, place, place), points - place)


@pytest.mark.parametrize("place", [0.0, 0.4, 1.0])
def test_the_distance_has_no_slope_on_the_segment_nor_on_one_of_no_length(place):
    start, end = jnp.zeros(3), jnp.array([0.0, 0.0, 2.0])
    for ends in ((start, end), (start, start)):
        point = ends[0] + place * (ends[1] - ends[0])
        for argument in range(3):
            slope = jax.grad(point_to_segment, argument)(point, *ends)
            np.testing.assert_array_equal(slope, 0.0)


@given(some_capsules(1, 4), GENERATORS)
def test_capsules_are_alike_as_a_union_of_parts_and_one_by_one(many, rng):
    points = rng.uniform(-1.5, 1.5, (50, 3))
    each = [
        Capsules(a, b, float(r)).distance(points) for a, b, r in zip(*many.arrays(), strict=True)
    ]
    np.testing.assert_array_equal(np.min(each, axis=0), many(points))
    np.testing.assert_array_equal(gap_to_capsules(points, *many.arrays()), many(points))
    apart = Capsules(many.start + 9 * np.arange(len(many))[:, None], many.end, many.radius)
    length = np.linalg.norm(apart.end - apart.start, axis=1)
    ball, tube = 4 / 3 * np.pi * apart.radius**3, np.pi * apart.radius**2 * length
    np.testing.assert_allclose(apart.volume, ball + tube)


def test_capsules_of_some_poses_are_those_of_a_batch():
    q = np.random.default_rng(0).uniform(-2, 2, (3, 6))
    bodies = robot_capsules(UR10, forward(UR10.chain, q))
    one = robot_capsules(UR10, forward(UR10.chain, q[1]))
    assert len(bodies) == len(one) == len(UR10.bodies)
    np.testing.assert_allclose(bodies.at(1).start, one.start, atol=1e-15)
    assert bodies.at(slice(0, 2)).end.shape == (2, len(one), 3)
