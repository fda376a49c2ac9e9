"""Square beams: between cones, in setups, with mounting errors, and in files."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.rings.mounting_errors import MountingErrors, draw_errors, misplaced_cones
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.rounding import rounded, table_of, with_scene
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.cones import Cones, around
from place_rings.objectives.mount_rules import Limits
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from pydantic import ValidationError

from ..strategies.units import FACINGS, GENERATORS, directions, ups
from ..support.scene_tables import reread

SQUARE = Sensor(math.radians(45), 1.2, None, math.radians(45), 8)
FLAT = Sensor(math.radians(60), 0.9, None, math.radians(30))
MIXED = Setup(
    (
        Ring("upper_arm", 0.3, 5, 0.3, 0.2, sensor=SQUARE),
        Ring("forearm", 0.5, 4),
        Ring("tool", 0.0, 3, sensor=FLAT),
    )
)


DEGREES = st.integers(3, 160)


@given(DEGREES, st.none() | DEGREES, FACINGS, st.integers(-180, 180), GENERATORS)
def test_a_beam_lies_between_its_inscribed_and_its_circumscribed_cone(
    fov_deg, fov_up_deg, facing_deg, roll_deg, rng
):
    fov_up = None if fov_up_deg is None else math.radians(fov_up_deg)
    sensor, apex = Sensor(math.radians(fov_deg), 0.9, None, fov_up), np.zeros((1, 3))
    axis, up = directions([facing_deg]), ups([facing_deg], [roll_deg])
    half, range_m, size = (np.array([v]) for v in sensor.sizes)
    beam = sensor.form(apex, axis, half, range_m, up if sensor.oriented else None, size)
    inner, outer = (
        Cones(apex, axis, np.array([half]), np.array([0.9]))
        for half in (sensor.inscribed_half_angle, sensor.circumscribed_half_angle)
    )
    points = inner.within(0, rng.random((200, 3)))
    assert np.all(inner(points) <= 1e-9)
    assert np.all(beam(points) <= 1e-9)
    points = beam.within(0, rng.random((200, 3)))
    assert np.all(beam(points) <= 1e-9)
    assert np.all(outer(points) <= 1e-9)
    np.testing.assert_allclose(around(beam).half_angle, [sensor.circumscribed_half_angle])
    # The corners touch the outer cone: none narrower would do.
    corners = 0.9 * axis[0] + beam.corners_across(0, 0.9)
    assert len(corners) == (4 if sensor.square else 0) == 4 * beam.by_rays()[0]
    np.testing.assert_allclose(outer.part(corners, 0), 0, atol=1e-9)


def test_a_beam_of_changed_angles_keeps_its_shape():
    wider = Sensor(0.4, 1.0, None, 0.6, 8).with_angles(lambda angle: 2 * angle)
    assert wider == Sensor(0.8, 1.0, None, 1.2, 8)
    assert not Sensor(0.4).with_angles(lambda angle: 2 * angle).square
    volume = 4 / 3 * 0.7**3 * math.tan(0.3) * math.tan(0.5)
    assert Sensor(0.6, 0.7, None, 1.0).volume == pytest.approx(volume)


def test_beams_without_a_square_are_plain_cones():
    rings = Setup((Ring("forearm", 0.5, 4), Ring("tool", 0.5, 2, sensor=Sensor(1.0, 0.4))))
    assert type(sensor_cones(UR10, rings, np.zeros(6))) is Cones


def test_ups_of_a_ring_are_across_its_tangent():
    solid = sensor_cones(UR10, MIXED, np.radians([0, -45, 60, -105, -90, 0]))
    np.testing.assert_allclose((solid.up * solid.axis).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(solid.up, axis=1), 1)
    frames = forward(UR10.chain, np.radians([0, -45, 60, -105, -90, 0]))
    mount = UR10.mount("tool")
    along = frames[mount.frame, :3, :3] @ mount.axis
    # no tilt: up is the ring's axis
    np.testing.assert_allclose(solid.up[9:], np.tile(along, (3, 1)), atol=1e-12)
    np.testing.assert_array_equal(solid.size > 0, [True] * 5 + [False] * 4 + [True] * 3)


def test_exact_counts_of_a_mixed_setup_agree():
    scene = Scene.paper(targets=(Scene.paper().targets[0].target,))
    target = scene.targets[0].target
    verifier = Verifier(scene, 0.04)
    zeta = verifier.verify(MIXED, target).zeta
    found = redundancy(verifier, MIXED, target)
    assert found.zeta == pytest.approx(zeta, abs=1e-12)
    without = [
        verifier.verify(Setup(tuple(r for j, r in enumerate(MIXED.rings) if j != i)), target).zeta
        for i in range(3)
    ]
    np.testing.assert_allclose(found.without_ring, without, atol=1e-12)
    interval = Verifier(scene, rule="certified", width=0.01).verify(MIXED, target)
    assert interval.low - 0.01 <= zeta <= interval.high + 0.01


def test_errors_of_mounting_turn_square_beams_with_their_rings():
    q = np.radians([0, -45, 60, -105, -90, 0])
    none = draw_errors(3, MIXED.sensors, MountingErrors(0.0, 0.0), 2, 0)
    nominal = sensor_cones(UR10, MIXED, q)
    for found in misplaced_cones(UR10, MIXED, q, none):
        for key in ("apex", "axis", "up", "size", "zoned"):
            np.testing.assert_allclose(getattr(found, key), getattr(nominal, key), atol=1e-12)
    for found in misplaced_cones(
        UR10, MIXED, q, draw_errors(3, MIXED.sensors, MountingErrors(0.01, 0.1), 2, 0)
    ):
        np.testing.assert_allclose((found.up * found.axis).sum(axis=1), 0, atol=1e-12)
        assert np.abs(found.up - nominal.up).max() > 1e-3


def test_mixed_setups_and_sensors_of_links_read_back():
    scene = Scene.paper(sensor=SQUARE, mounts={"forearm": Limits(sensor=FLAT)})
    assert reread(scene).limits_of("forearm").sensor.fov_up == pytest.approx(FLAT.fov_up)
    assert reread(scene).limits_of("forearm").sensor.zones == 1
    read = adapter(Setup).validate_python(table_of(MIXED, scene.sensor))
    again = with_scene(read, scene.sensor)
    assert again == rounded(again, scene.sensor)
    assert [r.sensor.fov_up is None for r in again.rings] == [False, True, False]
    assert [r.sensor.zones for r in again.rings] == [8, 1, 1]


def test_zones_are_the_models_or_those_that_are_said_and_one_else():
    of = adapter(Sensor)
    one, eight, up = {"model": "vl53l1x"}, {"model": "vl53l5cx"}, {"fov_up_deg": 30}
    said = ((one, 1), (eight, 8), (up, 1), (up | {"zones": 4}, 4), ({}, 1))
    for keys, zones in said:
        found = of.validate_python(keys)
        assert (found.zones, found.zoned) == (zones, zones > 1)
        assert of.validate_python(of.dump_python(found)).zones == zones
    for wrong in ({"zones": 4}, one | {"zones": 8}, eight | {"zones": 1}, {"zones": 0}):
        with pytest.raises(ValidationError, match="zones"):
            of.validate_python(wrong)
