"""Domes, fans and beams that begin at a distance: their functions, bounds, volumes and slopes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.base import CubePairs
from place_rings.coverage.solids.beams import InBeam

from ..strategies.singles import KINDS, SENSORS, fan, frustum, singles
from ..strategies.units import GENERATORS, failures, metres, points_mm
from ..support.refusals import refused

Q, WIDTH = np.zeros(6), 0.05
SETS = st.lists(singles(("base",)), min_size=1, max_size=4)
FOUR = st.lists(singles(("base",)), min_size=4, max_size=4)  # JAX compiles once


def beams_of(each):
    """The beams of single sensors in the base frame."""
    return sensor_cones(UR10, Setup((), tuple(each)), Q)


def inside(sensor, beams, k, points):
    """Which points lie in the beam ``k`` of a sensor, by angles and distances."""
    v = points - beams.apex[k]
    d, length = v @ beams.axis[k], np.linalg.norm(v, axis=1)
    angle = np.arccos(np.clip(d / np.maximum(length, 1e-12), -1, 1))
    half, range_m = sensor.half_angle, sensor.range_m
    if sensor.shape == "dome":
        return (length <= range_m) & (angle <= half)
    if sensor.shape == "frustum":
        wide = length * np.sin(angle) <= sensor.thickness / 2 + d * math.tan(half)
        return (d >= 0) & (d <= range_m) & wide
    between = (d >= sensor.near_m) & (d <= range_m)
    if not sensor.oriented:
        return between & (angle <= half)
    y, x = v @ beams.up[k], v @ np.cross(beams.up[k], beams.axis[k])
    if sensor.shape == "fan":
        flat = np.abs(y) <= sensor.thickness / 2
        return flat & (np.hypot(d, x) <= range_m) & (np.abs(np.arctan2(x, d)) <= half)
    wide = np.abs(x) <= d * math.tan(half)
    return between & wide & (np.abs(y) <= d * math.tan(sensor.half_angle_up))


@given(SETS, GENERATORS)
def test_functions_are_negative_inside(cones, rng):
    beams = beams_of(cones)
    points = rng.uniform(-1.5, 1.5, (400, 3))
    for k in range(len(beams)):
        value = beams.part(points, k)
        sure = np.abs(value) > 1e-9
        there = inside(cones[k].sensor, beams, k, points)
        assert failures(points, ~sure | ((value < 0) == there)) == []


@given(SENSORS, GENERATORS)
def test_a_sensor_holds_the_points_of_its_solid_in_its_own_frame(sensor, rng):
    """In 32 bits, as the search has them: but within rounding of the surface."""
    one, points = (
        MountedSensor("base", (0, 0, 0), (1, 0, 0), sensor, up=(0, 0, 1)),
        rng.uniform(-1.7, 1.7, (2000, 3)),
    )
    value = beams_of([one]).part(points, 0)
    along, left, up = points.T.astype(np.float32)
    held = sensor.holds(InBeam(along, left, up))
    assert failures(points, (np.abs(value) <= 2e-6) | (held == (value <= 0))) == []


@given(SETS, GENERATORS)
def test_bounds_hold_all_parts_and_samples_lie_inside(cones, rng):
    beams, unit = beams_of(cones), rng.random((200, 3))
    low, high = beams.bounds()
    index = rng.permutation(np.repeat(np.arange(len(beams)), len(unit)))
    each = beams.within(index, np.tile(unit, (len(beams), 1)))
    assert failures(each, beams.part(each, index) <= 1e-9) == []
    for k in range(len(beams)):
        points = beams.within(k, unit)
        assert failures(points, beams.part(points, k) <= 1e-9) == []
        assert (
            failures(points, ((points >= low - 1e-9) & (points <= high + 1e-9)).all(axis=1)) == []
        )


@given(singles(("base",)), GENERATORS)
def test_the_volume_is_that_of_many_points(one, rng):
    beams = beams_of([one])
    low, high = beams.bounds()
    points, box = rng.uniform(low, high, (20_000, 3)), float(np.prod(high - low))
    share = one.sensor.volume / box
    assert (beams.part(points, 0) <= 0).mean() == pytest.approx(
        share, abs=5.5 * math.sqrt(share / 20_000) + 1e-4
    )


@given(SETS, st.lists(points_mm(900), min_size=1, max_size=12), st.integers(5, 300), GENERATORS)
def test_tangent_planes_lie_below_the_functions(each, centres_mm, side_mm, rng):
    beams, side, centres = beams_of(each), side_mm / 1000, metres(centres_mm)
    offset = side * rng.uniform(-0.5, 0.5, (500, 1, 3))
    for k in range(len(beams)):
        index = np.full(len(centres), k)
        pairs = CubePairs(centres, np.arange(len(centres)), index, len(centres), side, 1e-12)
        _, value, normal = beams.each_share(pairs)
        below = value + (offset * normal).sum(axis=-1) <= beams.part(centres + offset, k) + 1e-9
        assert failures(centres, below.all(axis=0)) == []


@pytest.mark.parametrize("sensor", [*KINDS[:-1], fan(300, 500, 20), frustum(100, 500, 200)])
def test_a_round_surface_has_wider_bounds_without_its_curvature(sensor):
    """Those of pyramids, which have planes alone, are the same."""
    beams = beams_of([MountedSensor("base", (0, 0, 0), (1, 0, 0), sensor, up=(0, 0, 1))])
    points = np.random.default_rng(1).uniform(-0.6, 0.6, (20_000, 3))
    near = points[np.argsort(np.abs(beams(points)))[:500]]
    cell, part = np.arange(len(near)), np.zeros(len(near), int)
    curved, planes = (
        beams.shares(CubePairs(near, cell, part, len(near), 0.05, 1e-12, follow))
        for follow in (True, False)
    )
    assert (planes.low <= curved.low + 1e-12).all()
    assert (planes.high >= curved.high - 1e-12).all()
    wider = (planes.high - planes.low) - (curved.high - curved.low) > 1e-6
    assert wider.any() == (sensor.shape != "beam" or sensor.fov_up is None)


def test_a_half_ball_a_disc_and_a_cylinder_have_closed_forms():
    half_ball, pad = Sensor(math.pi, 0.3, shape="dome"), Sensor(2.0, 0.3, shape="dome")
    assert half_ball.volume == pytest.approx(2 / 3 * math.pi * 0.027)
    assert pad.volume == pytest.approx(2 / 3 * math.pi * 0.027 * (1 - math.cos(1)))
    disc = Sensor(2 * math.pi, 2.0, shape="fan", thickness=0.1)
    assert disc.volume == pytest.approx(math.pi * 4 * 0.1)
    assert disc.farthest == pytest.approx(math.hypot(2.0, 0.05))
    curtain = Sensor(1e-9, 2.0, shape="frustum", thickness=0.1)
    assert curtain.volume == pytest.approx(math.pi * 0.05**2 * 2)
    assert curtain.farthest == pytest.approx(math.hypot(2.0, 0.05))


@pytest.mark.parametrize(
    ("wrong", "parts"),
    [
        ({"shape": "dome", "fov": 3.2}, "fov 3.2"),
        ({"shape": "fan", "fov": 3.2}, "thickness nothing"),
        ({"shape": "fan", "thickness": 0.1, "fov": 6.4}, "fov 6.4"),
        ({"thickness": 0.1}, "thickness 0.1"),
        ({"shape": "frustum"}, "thickness nothing"),
        ({"shape": "frustum", "thickness": 0.1, "fov": 3.5}, "fov 3.5"),
        ({"shape": "frustum", "thickness": 0.1, "near_m": 0.1}, "near_m frustum"),
        ({"near_m": 1.5}, "near_m 1.5"),
        ({"shape": "dome", "near_m": 0.1}, "near_m 0.1"),
        ({"shape": "dome", "fov_up": 0.5}, "fov_up dome"),
    ],
)
def test_a_shape_that_cannot_be_is_refused(wrong, parts):
    with refused(parts, error=ValueError):
        Sensor(**wrong)


@given(SENSORS)
def test_every_shape_is_hashable_and_prints_itself(sensor):
    assert len({sensor, replace(sensor)}) == 1
    assert repr(sensor).startswith("Sensor(")
