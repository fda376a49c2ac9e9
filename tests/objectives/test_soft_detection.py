"""Soft detection: at every point the law by which the exact count judges it, and slopes that are
central differences.
"""

from dataclasses import replace
from functools import cache

import jax
import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.detection.detection import Detection
from place_rings.coverage.detection.pieces import PIECES
from place_rings.coverage.rings.ring import Setup, ring_values
from place_rings.coverage.rings.ring_kinematics import ring_arrays
from place_rings.coverage.soft.estimator import SHARP
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.detection_share import noticed_in
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.verify import Verifier

from ..strategies.rings import rings
from ..strategies.units import GENERATORS
from .test_soft_coverage import scene_of

POINTS, MOST, SENSORS = 300, 3, 12  # of each term; sensors of a ring; with the cell's, and padding
QUESTIONS = [
    Detection(piece=PIECES["torso"]),
    Detection(piece=PIECES["hand"], at_least=2),
]
OWN = [pr.sensors[name] for name in ("vl53l5cx", "vl53l1x")]
CASES = st.sampled_from([("ignore", 0), ("shadow", 1), ("blind", 0)])


def setups() -> st.SearchStrategy[Setup]:
    """Three rings of few sensors: of a cone without a model, and two of the catalogue."""

    def mixed(each):
        sensors = [each[0].sensor, *OWN]
        return Setup(tuple(replace(r, sensor=s) for r, s in zip(each, sensors, strict=True)))

    return st.lists(rings(MOST), min_size=3, max_size=3).map(mixed)


@cache
def soft_of(occlusion: str, question: int):
    scene = scene_of(2, occlusion=occlusion, targets=(pr.Near(0.3),))
    scene = replace(scene, poses=scene.poses[:1])
    aim = Criterion(detection=QUESTIONS[question])
    return scene, SoftCoverage(scene, [(0, 0)], [np.zeros((POINTS, 3))], aim)


def arrays_of(scene, setup, detection):
    groups = scene.with_cell(setup).groups
    v = ring_values(groups)
    arrays = ring_arrays(scene.robot, groups, SENSORS, OWN, detection)
    return arrays, np.stack([v.position, v.tilt, v.phase])


def about(scene, setup, rng) -> np.ndarray:
    """Points (1, N, 3) before the sensors."""
    law = noticed_in(scene, setup, 0, QUESTIONS[0])
    k = rng.integers(len(law), size=POINTS)
    apex, axis = (np.asarray(a)[k] for a in (law.cones.apex, law.cones.axis))
    depth = rng.uniform(0.1, 1.2, (POINTS, 1))
    points = apex + depth * axis + 0.3 * depth * rng.standard_normal((POINTS, 3))
    return points[None].astype(np.float32)


@pytest.mark.slow
@settings(max_examples=12)
@given(setups(), CASES, GENERATORS)
def test_the_share_is_the_mean_of_the_exact_law(setup, case, rng):
    occlusion, question = case
    scene, soft = soft_of(occlusion, question)
    arrays, values = arrays_of(scene, setup, QUESTIONS[question])
    points = about(scene, setup, rng)
    sample = soft.all._replace(points=jax.numpy.asarray(points))
    exact = noticed_in(scene, setup, 0, QUESTIONS[question]).at(points[0].astype(float))
    # beside a shadow its distance is approximate, and rounding moves points past edges
    error = 1e-3 if occlusion == "ignore" else 0.02
    assert soft.share(arrays, values, SHARP, sample) == pytest.approx(exact.mean(), abs=error)


@pytest.mark.slow
@settings(max_examples=10)
@given(setups(), CASES, GENERATORS)
def test_slopes_are_central_differences(setup, case, rng):
    occlusion, question = case
    scene, soft = soft_of(occlusion, question)
    arrays, values = arrays_of(scene, setup, QUESTIONS[question])
    sample = soft.all._replace(points=jax.numpy.asarray(about(scene, setup, rng)))
    value, slope = soft.value_and_slope(arrays, values, 0.01, sample)
    assert np.isfinite(slope).all()
    assert 0 <= value <= 1
    way = rng.uniform(-1, 1, values.shape)
    way[:, len(setup.rings) :] = 0  # the cell's sensor stands still
    along = pytest.approx(float((slope * way).sum()), abs=0.02, rel=0.1)

    def measured(step):
        ends = [soft.share(arrays, values + s * step * way, 0.01, sample) for s in (-1, 1)]
        return (ends[1] - ends[0]) / (2 * step)

    # of 32 bits; a point that passes an edge of the law is a jump, which long steps hardly show
    assert any(measured(step) == along for step in (2e-4, 1e-3, 3e-3))


@pytest.mark.slow
def test_the_share_of_points_tends_to_the_exact_count():
    scene = pr.Scene(robot="ur5e", targets=[pr.Near(0.3)], sensor=pr.sensors["vl53l1x"])
    setup, detection = ring_layout(scene, 1, 8), Detection()
    _, exact = judge(Verifier(scene, 0.03), setup, Criterion(detection=detection))
    for count in (512, 8192):
        points = pr.sample_points(scene, count)
        share = float(pr.coverage_fraction(setup, scene, points, detect=detection))
        assert share == pytest.approx(exact, abs=2 / np.sqrt(count))


def test_a_ring_of_sensors_that_complete_no_frame_detects_nothing():
    scene = pr.Scene(robot="ur5e", sensor=pr.sensors["vl53l1x"])
    points = pr.sample_points(scene, 64)
    setup, never = ring_layout(scene, 1, 4), Detection(seconds=0.001)
    assert float(pr.coverage_fraction(setup, scene, points, detect=never)) == 0
