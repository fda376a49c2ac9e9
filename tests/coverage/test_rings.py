"""Rings, the paper's setups, and the independent reference numbers of the scene."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, named_setup
from place_rings.coverage.rings.ring_kinematics import (
    sensor_cones,
)
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import PAPER_SENSOR
from place_rings.coverage.targets.named import ReachAndToolSpheres, Shell
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

from ..strategies.rings import poses, setups

# Uniform random points by an independent program, standard error up to 0.15 points: V_S(0.5),
# V_S(1.5), V_OT on ur10.
REFERENCE = {
    "n1_8_0": (16.0, 16.3, 16.0),
    "n1_16_0": (33.3, 30.5, 29.9),
    "n2_16_0": (46.5, 46.7, 43.6),
    "n2_16_10": (44.7, 39.7, 38.4),
    "n2_16_25": (44.5, 45.1, 42.2),
    "n2_16_55": (86.8, 36.9, 41.5),
    "n3_16_55": (89.0, 52.4, 53.9),
}
REFERENCE_DH = {"n3_16_55": (88.1, 57.3, 53.8)}
TARGETS = (Shell(0.5), Shell(1.5), ReachAndToolSpheres())


@pytest.mark.parametrize(("robot", "table"), [("ur10", REFERENCE), ("ur10_dh", REFERENCE_DH)])
def test_reference_numbers_are_reproduced(robot, table):
    verifier = Verifier(Scene.paper(robot=ROBOTS[robot]), voxel=0.02)
    for name, expected in table.items():
        for target, percent in zip(TARGETS, expected, strict=True):
            found = 100 * verifier.verify(named_setup(name), target).zeta
            assert found == pytest.approx(percent, abs=0.6), f"{name} {target}"


def test_names_are_the_papers_setups():
    assert named_setup("n1_8_0").sensors == 24
    assert named_setup("n2_16_25").sensors == 80
    three = named_setup("n3_16_55")
    assert three.sensors == 112
    arm = [
        (r.position, round(math.degrees(r.tilt), 6)) for r in three.rings if r.link == "upper_arm"
    ]
    assert arm == [(0.0, 55), (0.5, 0), (1.0, -55)]
    assert [(r.link, r.tilt, r.count) for r in three.rings][-1] == ("tool", 0, 16)
    for name in ("n4_16_0", "n2_0_0", "n2_16", "n2_16_25x", "", "N2_16_25", "n2_-3_0"):
        with pytest.raises(ValueError, match=repr(name)):
            named_setup(name)


def test_papers_sensor_sees_its_volume():
    assert PAPER_SENSOR.volume == pytest.approx(0.1737, abs=5e-5)


@given(setups(), poses())
def test_sensors_stand_evenly_on_their_ring(setup, q):
    cones = sensor_cones(UR10, setup, q)
    frames = forward(UR10.chain, q)
    first = 0
    for ring in setup.rings:
        m = UR10.mount(ring.link)
        R, origin = frames[m.frame, :3, :3], frames[m.frame, :3, 3]
        axis, centre = R @ m.axis, origin + R @ (m.start + ring.position * m.length * m.axis)
        apex, look = (a[first : first + ring.count] for a in (cones.apex, cones.axis))
        out = apex - centre
        assert np.allclose(out @ axis, 0, atol=1e-12)
        assert np.allclose(np.linalg.norm(out, axis=1), ring.radius)
        assert np.allclose(look @ axis, math.sin(ring.tilt))
        assert np.allclose(np.linalg.norm(look, axis=1), 1)
        assert np.allclose((look * out).sum(axis=1), math.cos(ring.tilt) * ring.radius)
        turned = math.cos(ring.phase) * (R @ m.zero) + math.sin(ring.phase) * (R @ m.side)
        assert np.allclose(out[0], ring.radius * turned)
        if ring.count > 2:
            assert np.all(np.cross(out, np.roll(out, -1, axis=0)) @ axis > 0)  # right-handed
        first += ring.count


@given(st.floats(-9, 9), st.floats(-math.pi, math.pi))
def test_a_ring_as_it_was_measured_may_sit_beyond_an_end_and_tilt_by_any_angle(position, tilt):
    ring = Ring("forearm", position, 8, tilt)
    assert (ring.position, ring.tilt) == (position, tilt)


@pytest.mark.parametrize(
    "wrong",
    [
        {"position": math.nan},
        {"position": math.inf},
        {"tilt": 90.0},
        {"radius": -1.0},
        {"count": -1},
    ],
)
def test_a_ring_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Ring(**({"link": "forearm", "position": 0.5, "count": 8} | wrong))
