"""Inputs at the edge of sense: needles and near half-spaces, millimetres and a hundred metres,
tubes across themselves.
"""

import math
import re
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.pytrees import mapped
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.solids.swept_tube import Tube
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.coverage.voxels.voxel_set import FURTHEST
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier, check_beams

from ..strategies.solids import padded
from ..support import drawing
from ..support.soft_beams import rings_of_one, share_and_slopes
from .test_certified_bounds import one_cone
from .test_octree import dense, lattice


def drawn_cones(rng, half_deg, range_m, spread, n=4):
    """Cones of one shape whose apexes lie within ``spread``."""
    return Cones(
        rng.uniform(-spread, spread, (n, 3)),
        drawing.unit(rng, n),
        np.full(n, math.radians(half_deg)),
        np.full(n, range_m),
    )


def loop(radius):
    """A tube that runs along a figure of eight, through itself, with discs that cross."""
    t = np.linspace(0, 2 * math.pi, 40)
    centre = np.column_stack([np.sin(t), np.sin(t) * np.cos(t), 0 * t])
    tangent = np.column_stack([np.cos(t), np.cos(2 * t), 0 * t])
    return Tube(
        centre, tangent / np.linalg.norm(tangent, axis=1, keepdims=True), radius, np.arange(39)
    )


RNG = np.random.default_rng(7)
BALL = sphere(np.zeros(3), 1.0)
TWINS = drawn_cones(RNG, 20, 1.5, 0.5, 1)
SCENES = {
    "needles of 0.1 degrees": (BALL, drawn_cones(RNG, 0.05, 2.0, 0.5), 0.07),
    "cones of 179 degrees": (BALL, drawn_cones(RNG, 89.5, 0.3, 0.5), 0.07),
    "ranges of 1 mm": (sphere(np.zeros(3), 0.002), drawn_cones(RNG, 30, 0.001, 0.001), 0.0002),
    "1 mm in a ball of 1 m": (BALL, drawn_cones(RNG, 30, 0.001, 0.5), 0.07),
    "ranges of 100 m": (sphere(np.zeros(3), 80.0), drawn_cones(RNG, 20, 100.0, 40.0), 6.0),
    "100 m in a ball of 1 m": (BALL, drawn_cones(RNG, 20, 100.0, 0.5), 0.07),
    "a tube across itself": (loop(0.5), drawn_cones(RNG, 20, 1.5, 0.5), 0.08),
    "a thick tube with crossing discs": (
        Difference(loop(0.9), loop(0.2)),
        drawn_cones(RNG, 20, 1.5, 0.5),
        0.1,
    ),
    "coincident cones": (BALL, mapped(lambda a: np.repeat(a, 5, axis=0), TWINS), 0.07),
    "wholly covered": (BALL, one_cone((0, 0, -9), (0, 0, 1), 0.5, 20), 0.07),
    "wholly uncovered": (BALL, one_cone((0, 0, 9), (0, 0, 1), 0.5, 7), 0.07),
}


@pytest.mark.parametrize("name", SCENES)
def test_count_interval_and_estimate_hold(name):
    """The octree is the dense count; the interval holds the share of points; the soft estimate is
    finite and near.
    """
    target, cones, voxel = SCENES[name]
    low, high = target.bounds()
    centres = lattice(low, high, voxel)
    wanted = dense(target, centres, voxel, "centre")
    found = voxels(target, voxel)
    assert len(found) == wanted.sum() > 100
    assert (
        count(cones, voxel, within=found) == (wanted & dense(cones, centres, voxel, "centre")).sum()
    )
    p = np.random.default_rng(1).uniform(low, high, (40_000, 3))
    p = p[target(p) <= 0]
    held = cones(p) <= 0
    noise = math.sqrt(math.log(2e7) / (2 * len(p)))
    b = bracket(target, cones, 5e-3)
    assert b.reached
    assert b.low - noise <= held.mean() <= b.high + noise
    size, n = float(np.ptp([low, high])), 4096  # of one shape, so that JAX compiles once
    rings, few = rings_of_one(padded(cones, 5)), p[:n].astype(np.float32)
    soft, slopes = share_and_slopes(rings, few, jnp.float32(1e-3 * size))
    assert float(soft) == pytest.approx(held[:n].mean(), abs=0.03)
    assert all(np.isfinite(a).all() for a in jax.tree.leaves(slopes))


@given(st.floats(1, 179.9999), st.floats(0.01, 100), st.none() | st.floats(1, 179.9999))
def test_a_beam_is_refused_for_its_own_width_before_the_voxels_are_blamed(fov, range_m, up):
    sensor = Sensor(math.radians(fov), range_m, fov_up=None if up is None else math.radians(up))
    ring, voxel = Ring("upper_arm", 0.5, 3, sensor=sensor), 0.05
    scene = Scene.paper(sensor=sensor)
    refused = None
    try:
        check_beams(scene.sensors, voxel)
    except ValueError as error:
        refused = str(error)
    if refused is None:  # the lattice holds it
        box = sensor_cones(scene.robot, Setup((ring,)), scene.poses[0].q).bounds()
        assert np.abs(box).max() < FURTHEST * voxel
        return
    assert re.match(r"sensor: found fov [\d.]+°( by [\d.]+°)? at range", refused)
    with pytest.raises(ValueError, match="found fov"):
        Verifier(scene, voxel).verify(Setup((ring,)), Shell(0.5))
    allowed = float(re.search(r"up to ([\d.]+)°", refused)[1])
    assert allowed < max(fov, up or 0)
    half = math.radians(allowed)
    check_beams([replace(sensor, fov=half, fov_up=None if up is None else half)], voxel)
