"""What no sensor reaches: a bound that every layout keeps, said before the search."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.reach import farthest, reachable_share
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.reporting.lines.reach import reach_lines

from ..support import drawing


@settings(max_examples=20)
@given(drawing.seeds)
def test_no_layout_covers_more_than_is_within_reach(seed):
    rng = np.random.default_rng(seed)
    sensor = Sensor(math.radians(rng.uniform(20, 150)), float(rng.uniform(0.1, 0.6)))
    target = Target("V_S", float(rng.uniform(0.3, 1.5)))
    rings = tuple(
        Ring(link, float(rng.uniform()), 24, float(rng.uniform(-1, 1)), sensor=sensor)
        for link in ("upper_arm", "forearm", "tool")
        for _ in range(4)
    )
    scene = paper_scene(sensor=sensor, goals=(Goal(target),))
    share = reachable_share(scene, target)
    zeta = Verifier(scene, 0.05).verify(Setup(rings), target).zeta
    assert zeta <= share + 0.02  # voxels of 5 cm, 4096 points


def test_the_farthest_point_of_a_beam_is_its_corner():
    cone, square = Sensor(1.0, 2.0), Sensor(1.0, 2.0, None, 0.6)
    assert farthest(cone) == pytest.approx(2 / math.cos(0.5))
    corner = 2 * np.array([1, math.tan(0.5), math.tan(0.3)])
    assert farthest(square) == pytest.approx(float(np.linalg.norm(corner)))


def test_a_target_beyond_reach_is_said_and_others_are_not():
    usual = [Target("V_O"), Target("V_T"), Target("V_OT"), Target("V_S", 0.5), Target("V_S", 1.5)]
    assert reach_lines(paper_scene(goals=tuple(Goal(t) for t in usual))) == []
    (line,) = reach_lines(paper_scene(goals=(Goal(Target("V_S", 0.5)), Goal(Target("V_S", 3.0)))))
    assert line.startswith("V_S(3) extends beyond the sensors' reach")
    assert "1.54 m" in line
    short = paper_scene(sensor=Sensor(range_m=0.05))
    (line,) = reach_lines(short)
    assert "more than about 1 %" in line
    fixed = Rules(fixed=(Ring("forearm", 0.5, 8, sensor=Sensor(range_m=3.0)),))
    more = paper_scene(sensor=Sensor(range_m=0.05), rules=fixed)
    assert reachable_share(more, Target("V_S", 0.5)) > 0.9


@pytest.mark.long
def test_the_command_says_it_before_the_search(run):
    code, _, err = run("--target", "V_S:3", "--time", "0.5", "--voxel", "0.1")
    assert code == 0
    assert "V_S(3) extends beyond the sensors' reach" in err
