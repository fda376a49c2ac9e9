"""The largest unseen spheres in a twin whose rays share no code with their bounds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.targets.own import Sphere
from place_rings.simulation.twin.building import TwinOptions, sensor_twin
from place_rings.studies.detection import study
from place_rings.studies.detection.spheres import SphereTrials, reports, spheres
from place_rings.studies.engine.scenes import scene_from, setup_from


@settings(max_examples=10, deadline=None)
@given(radius=st.floats(0.02, 0.1), depth=st.floats(0.2, 1.0), turn=st.floats(-math.pi, math.pi))
def test_a_sphere_is_reported_where_it_reaches_into_a_cone(radius, depth, turn):
    """Just beside the side of a beam, no zone reports it; a tenth of its radius further in, one
    does."""
    scene = scene_from(study.scene_keys("ur10", None))
    setup = setup_from([{"link": "tool", "count": 1}], scene)
    options = TwinOptions(bodies=[Sphere(radius)], mask="scene", noise=None, finer=4)
    twin = sensor_twin("", setup, scene, options)
    half, frame = scene.sensor.fov / 2, twin.world.frame[0]
    aside = depth * math.tan(half) + radius / math.cos(half)
    if depth + radius > scene.sensor.range_m:
        return
    for off, seen in ((1e-4, False), (-0.1 * radius, True)):
        x, y = (aside + off) * math.cos(turn), (aside + off) * math.sin(turn)
        there = twin.world.apex[0] + frame @ np.array([x, y, depth])
        assert (reports(twin, 0, there) > 0) == seen


@pytest.mark.parametrize("model", [pytest.param("vl53l1x", marks=pytest.mark.slow), "vl53l5cx"])
def test_no_zone_reports_the_largest_unseen_sphere_and_some_zone_a_larger_one(model):
    asked = {"setup": "n2_8_25", "target": "V_S", "radius": 0.5}
    each = spheres(study.scene_keys("ur10", model), places=10, seed=0, **asked)
    one = SphereTrials(**each)
    assert 0 < one.low_mm <= one.high_mm
    assert one.reports == 0
    assert one.met >= 0.9 * one.places


def test_a_sphere_well_above_the_bound_would_be_reported_at_that_place():
    """The check can fail: twice the diameter meets rays there."""
    scene = scene_from(study.scene_keys("ur10", "vl53l5cx"))
    setup = setup_from("n2_16_25", scene)
    options = TwinOptions(bodies=[Sphere(0.6)], mask="scene", noise=None)
    twin = sensor_twin("", setup, scene, options)
    points = scene.sample(study.SHELL, 0, 64, 0)
    assert all(reports(twin, 0, point) > 0 for point in points)
