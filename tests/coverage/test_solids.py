"""Laws of implicit functions: sign, Lipschitz constant, box, gradients, NumPy against JAX."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.solids.base import (
    VALUES,
    Algebra,
    Difference,
    Intersection,
    Union,
    fold,
    leaves,
)
from place_rings.coverage.solids.closed_mesh import ClosedMesh
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import Spheres, sphere
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.octree import count
from place_rings.objectives.scene import Scene

from ..strategies.singles import singles
from ..strategies.solids import (
    MESHES,
    REGIONS,
    some_beams,
    some_capsules,
    some_solids,
)
from ..strategies.units import GENERATORS, failures, uniform_directions
from ..strategies.volumes import ANYWHERE, BOXES, CAPSULES, CONES, CYLINDERS, VOLUMES
from .test_octree import dense, lattice
from .test_volume_fraction import shares

KINDS = {
    "cones, balls and tubes": some_solids(),
    "capsules": some_capsules(1, 4, 400, (50, 300)),
    "beams": some_beams(2, 2),
    "beams of all shapes": st.lists(singles(("base",)), min_size=1, max_size=4).map(
        lambda each: sensor_cones(UR10, Setup((), tuple(each)), np.zeros(6))
    ),
    "boxes and cylinders": (BOXES | CYLINDERS).map(lambda v: v.solid(ANYWHERE)),
    "frusta": CONES.map(lambda v: v.solid(ANYWHERE)),
    "capsules as targets": CAPSULES.map(lambda v: v.solid(ANYWHERE)),
    "volumes": VOLUMES.map(lambda v: target_solid(v, UR10, Scene.poses[0].q)),
    "meshes": MESHES.map(
        lambda m: ClosedMesh(np.array(m.vertices, float), np.array(m.faces, np.int64))
    ),
    "cubes": REGIONS,
}
each_kind = pytest.mark.parametrize("kind", KINDS)
each_closed_kind = pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "volumes"])


@each_kind
@settings(max_examples=12)
@given(st.data(), GENERATORS)
def test_never_changes_faster_than_distance(kind, data, rng):
    solid = data.draw(KINDS[kind])
    a = rng.uniform(-2, 2, (200, 3))
    b = a + uniform_directions(rng, 200) * 10.0 ** rng.uniform(-6, 0.5, (200, 1))
    distance = np.linalg.norm(a - b, axis=1)
    assert failures(a, np.abs(solid(a) - solid(b)) <= distance * (1 + 1e-9) + 1e-9) == []


@each_closed_kind
@settings(max_examples=12)
@given(st.data(), GENERATORS)
def test_box_holds_the_solid(kind, data, rng):
    solid = data.draw(KINDS[kind])
    low, high = solid.bounds()
    p = rng.uniform(low - 1, high + 1, (2000, 3))
    outside = np.any((p < low - 1e-12) | (p > high + 1e-12), axis=1)
    assert failures(p, (solid(p) >= -1e-12) | ~outside) == []


@each_closed_kind
@pytest.mark.parametrize("rule", ["centre", "touch"])
@settings(max_examples=4)
@given(st.data(), st.floats(0.9, 1.0))
def test_count_is_the_dense_count(kind, rule, data, share):
    solid = data.draw(KINDS[kind])
    low, high = solid.bounds()
    most = (30_000 if rule == "centre" else 500) // (12 if kind == "meshes" else 1)
    voxel = share * float(max((high - low).prod() / most, 1e-6) ** (1 / 3))
    assert count(solid, voxel, rule) == dense(solid, lattice(low, high, voxel), voxel, rule).sum()


@each_closed_kind
@settings(max_examples=5)
@given(st.data(), GENERATORS, st.sampled_from([0.2, 0.05, 0.01]))
def test_shares_of_cubes_hold(kind, data, rng, side):
    """The bounds of a cube's share hold the share of many points in it; most are at a surface."""
    solid = data.draw(KINDS[kind])
    low, high = solid.bounds()
    points = rng.uniform(low - 0.1, high + 0.1, (400, 3))
    points = points[np.argsort(np.abs(solid(points)))[:20]]
    inside = rng.uniform(-0.5, 0.5, (1000, 3)) * side
    noise = math.sqrt(math.log(2 * 20 * 1e7) / (2 * len(inside)))
    for parts in leaves(solid):
        bounds = shares(parts, points, side)
        share = np.array([parts.holds(p + inside).mean() for p in points])
        assert failures(points, bounds.low - noise <= share) == []
        assert failures(points, bounds.high + noise >= share) == []
        assert kind != "cubes" or (bounds.high - bounds.low < 1e-6).all()


@settings(max_examples=12)
@given(some_solids(one_size=True), GENERATORS)
def test_numpy_and_jax_agree(solid, rng):
    p = rng.uniform(-2, 2, (300, 3))
    assert failures(p, np.abs(solid(p) - np.asarray(solid(jnp.asarray(p)))) <= 1e-12) == []


def test_empty_union_is_outside_everywhere():
    nothing = Cones(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    assert np.all(nothing(np.zeros((5, 3))) == np.inf)


def test_combinations_are_set_operations():
    rng = np.random.default_rng(1)
    p = rng.uniform(-2, 2, (5000, 3))
    a, b = sphere([0.0, 0, 0], 1.0), sphere([0.7, 0, 0], 1.0)
    in_a, in_b = a(p) <= 0, b(p) <= 0
    assert np.array_equal(Union(a, b)(p) <= 0, in_a | in_b)
    assert np.array_equal(Intersection(a, b)(p) <= 0, in_a & in_b)
    assert np.array_equal(Difference(a, b)(p) <= 0, in_a & ~in_b)


class Odd:
    """A solid of another kind."""

    def __call__(self, points):
        return points[:, 0]

    def bounds(self):
        return np.zeros((2, 3))


def test_fold_takes_the_values_of_leaves_in_their_order():
    rng = np.random.default_rng(3)
    a, b, c = (Spheres(rng.uniform(-0.5, 0.5, (2, 3)), np.full(2, 0.6)) for _ in range(3))
    solid = Difference(Intersection(a, b), Union(c, a))
    assert [id(parts) for parts in leaves(solid)] == [id(parts) for parts in (a, b, c, a)]
    points = rng.uniform(-1, 1, (200, 3))
    each = [parts(points) for parts in leaves(solid)]
    np.testing.assert_array_equal(fold(solid, each, VALUES), solid(points))
    words = Algebra[str]("({} or {})".format, "({} and {})".format, "not {}".format)
    assert fold(solid, list("abcd"), words) == "((a and b) and not (c or d))"
    with pytest.raises(ValueError, match=r"3.* 4"):
        fold(solid, each[:3], VALUES)
    with pytest.raises(TypeError, match="Odd"):
        leaves(Odd())
