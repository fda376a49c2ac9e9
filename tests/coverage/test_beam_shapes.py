"""Domes, fans and beams that begin at a distance: their functions, bounds, volumes and slopes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.base import CubePairs
from place_rings.coverage.solids.sensor_beams import MixedBeams, SpecialShapes
from place_rings.coverage.voxels.solid_bitmask import words
from place_rings.coverage.voxels.voxel_bitmask import CORNER, BlockGrid

from ..strategies.singles import DOMES, FANS, SENSORS, singles
from ..strategies.units import GENERATORS, failures, metres, points_mm
from ..support.refusals import refused

Q, WIDTH = np.zeros(6), 0.05
SETS = st.lists(singles(("base",)), min_size=1, max_size=4)
FOUR = st.lists(singles(("base",)), min_size=4, max_size=4)  # JAX compiles once


def special(each):
    """The beams of single sensors as the most general class, whatever they are."""
    cones = sensor_cones(UR10, Setup((), tuple(each)), Q)
    if isinstance(cones, MixedBeams) and cones.special is not None:
        return cones
    none = np.zeros(len(cones))
    up = cones.up if isinstance(cones, MixedBeams) else np.tile([[0.6, 0.8, 0.0]], (len(cones), 1))
    half_up = cones.half_up if isinstance(cones, MixedBeams) else none
    look = (cones.apex, cones.axis, cones.half_angle, cones.range_m)
    return MixedBeams(*look, up, half_up, none > 0, SpecialShapes(none > 0, none, none))


def inside(cones, k, points):
    """Which points lie in part ``k``, by angles and distances."""
    v = points - cones.apex[k]
    d, length = v @ cones.axis[k], np.linalg.norm(v, axis=1)
    angle = np.arccos(np.clip(d / np.maximum(length, 1e-12), -1, 1))
    half, range_m = cones.half_angle[k], cones.range_m[k]
    if cones.special.dome[k]:
        return (length <= range_m) & (angle <= half)
    y, x = v @ cones.up[k], v @ np.cross(cones.up[k], cones.axis[k])
    if cones.special.half_thickness[k] > 0:
        flat = np.abs(y) <= cones.special.half_thickness[k]
        return flat & (np.hypot(d, x) <= range_m) & (np.abs(np.arctan2(x, d)) <= half)
    between = (d >= cones.special.near[k]) & (d <= range_m)
    if cones.half_up[k] > 0:
        wide = np.abs(x) <= d * math.tan(half)
        return between & wide & (np.abs(y) <= d * math.tan(cones.half_up[k]))
    return between & (angle <= half)


@given(SETS, GENERATORS)
def test_functions_are_negative_inside_and_lipschitz(cones, rng):
    beams = special(cones)
    points = rng.uniform(-1.5, 1.5, (400, 3))
    for k in range(len(beams)):
        value = beams.part(points, k)
        sure = np.abs(value) > 1e-9
        there = inside(beams, k, points)
        assert failures(points, ~sure | ((value < 0) == there)) == []
        step = rng.normal(size=points.shape) * rng.choice([1e-3, 0.1, 1], (400, 1))
        change = np.abs(beams.part(points + step, k) - value)
        assert failures(points, change <= np.linalg.norm(step, axis=1) * (1 + 1e-9) + 1e-12) == []


@given(SETS, GENERATORS)
def test_bounds_hold_all_parts_and_samples_lie_inside(cones, rng):
    beams, unit = special(cones), rng.random((200, 3))
    low, high = beams.bounds()
    for k in range(len(beams)):
        points = beams.within(k, unit)
        assert failures(points, beams.part(points, k) <= 1e-9) == []
        assert (
            failures(points, ((points >= low - 1e-9) & (points <= high + 1e-9)).all(axis=1)) == []
        )


@given(singles(("base",)), GENERATORS)
def test_the_volume_is_that_of_many_points(one, rng):
    beams = special([one])
    low, high = beams.bounds()
    points, box = rng.uniform(low, high, (20_000, 3)), float(np.prod(high - low))
    share = one.sensor.volume / box
    assert (beams.part(points, 0) <= 0).mean() == pytest.approx(
        share, abs=5.5 * math.sqrt(share / 20_000) + 1e-4
    )


@given(SETS, st.lists(points_mm(900), min_size=1, max_size=12), st.integers(5, 300))
def test_shares_of_cubes_are_within_their_bounds(cones, centres_mm, side_mm):
    """Of 8000 points on a lattice in each cube; a surface moves the share by at most its layers."""
    beams, side = special(cones), side_mm / 1000
    centres, steps = metres(centres_mm), (np.arange(20) + 0.5) / 20 - 0.5
    offsets = side * np.stack(np.meshgrid(steps, steps, steps), -1).reshape(-1, 3)
    for k in range(len(beams)):
        cell, index = np.arange(len(centres)), np.full(len(centres), k)
        pairs = CubePairs(centres, cell, index, len(centres), side, 1e-12)
        share, value, normal = beams.each_share(pairs)
        for i, centre in enumerate(centres):
            function = beams.part(centre + offsets, k)
            counted = (function <= 0).mean()
            error = (np.abs(function) <= side / 20 * 3**0.5 / 2).mean() / 2 + 1e-3
            assert share.low[i] - error <= counted <= share.high[i] + error
            assert (value[i] + offsets @ normal[i] <= function + 1e-9).all()


@given(SETS, st.lists(points_mm(900), min_size=1, max_size=12), st.integers(5, 200))
def test_bitmasks_are_the_signs_at_the_voxels(cones, centres_mm, voxel_mm):
    beams, voxel, centres = special(cones), voxel_mm / 1000, metres(centres_mm)
    grid, offsets = BlockGrid(voxel, 1e-9), (CORNER - 1.5) * voxel
    for k in range(len(beams)):
        mask = words(beams, grid, centres, np.full(len(centres), k))
        for i, centre in enumerate(centres):
            value = beams.part(centre + offsets, k)
            bits = [
                np.array([int(word) >> n & 1 for n in range(64)], bool)
                for word in (mask.sure[i], mask.maybe[i])
            ]
            assert not (bits[0] & (value > 1e-9)).any()
            assert not (~bits[1] & (value <= -1e-9)).any()


def test_a_dome_of_half_a_ball_and_a_fan_of_a_full_turn_have_closed_forms():
    half_ball, pad = Sensor(math.pi, 0.3, shape="dome"), Sensor(2.0, 0.3, shape="dome")
    assert half_ball.volume == pytest.approx(2 / 3 * math.pi * 0.027)
    assert pad.volume == pytest.approx(2 / 3 * math.pi * 0.027 * (1 - math.cos(1)))
    disc = Sensor(2 * math.pi, 2.0, shape="fan", thickness=0.1)
    assert disc.volume == pytest.approx(math.pi * 4 * 0.1)
    assert disc.farthest == pytest.approx(math.hypot(2.0, 0.05))


@pytest.mark.parametrize(
    ("wrong", "parts"),
    [
        ({"shape": "dome", "fov": 3.2}, "fov 3.2"),
        ({"shape": "fan", "fov": 3.2}, "thickness nothing"),
        ({"shape": "fan", "thickness": 0.1, "fov": 6.4}, "fov 6.4"),
        ({"thickness": 0.1}, "thickness 0.1"),
        ({"near_m": 1.5}, "near_m 1.5"),
        ({"shape": "dome", "near_m": 0.1}, "near_m 0.1"),
        ({"shape": "dome", "fov_up": 0.5}, "fov_up dome"),
    ],
)
def test_a_shape_that_cannot_be_is_refused(wrong, parts):
    with refused(parts, error=ValueError):
        Sensor(**wrong)


@given(SENSORS | DOMES | FANS)
def test_every_shape_is_hashable_and_prints_itself(sensor):
    assert len({sensor, replace(sensor)}) == 1
    assert repr(sensor).startswith("Sensor(")
