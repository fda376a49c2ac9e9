"""Fewest sensors: the answer reaches what was wanted, with fewer than what did not."""

import pytest
from place_rings.coverage.robots import UR10
from place_rings.coverage.targets import Target
from place_rings.objectives.exact import Verifier
from place_rings.objectives.scene import Goal, Limits, Rules, Scene
from place_rings.placement.candidates import InfeasibleError
from place_rings.placement.progress import Outcome
from place_rings.placement.reach import fewest_sensors
from place_rings.placement.schedule import Schedule, Stage

QUICK = Schedule(4, (Stage(0.1, 512, 6, 2), Stage(0.03, 512, 6, 1, variants=1)), draws=16)
SCENE = Scene(goals=(Goal(Target("V_S", 0.5)),), rules=Rules(sensors=(4, 16)))


@pytest.fixture(scope="module")
def found():
    return fewest_sensors(SCENE, 0.5, seed=1, schedule=QUICK, voxel=0.05)


def test_the_answer_reaches_what_was_wanted(found):
    assert found.reached
    assert found.result.exact >= 0.5
    assert Verifier(SCENE, 0.05).judge(found.result.setup) == (0.0, found.result.exact)
    assert all(4 <= ring.count <= 16 for ring in found.result.setup.rings)


def test_it_is_the_fewest_of_those_that_were_tried(found):
    best = found.result.setup.sensors
    assert found.tried[best] == (found.result.exact, True)
    assert all(ok == (exact >= 0.5) for exact, ok in found.tried.values())
    assert not any(ok for n, (_, ok) in found.tried.items() if n < best)
    assert best - 1 in found.tried


def test_same_seed_same_answer(found):
    again = fewest_sensors(SCENE, 0.5, seed=1, schedule=QUICK, voxel=0.05)
    assert (again.result.setup, again.tried) == (found.result.setup, found.tried)


def test_a_time_cap_gives_the_best_until_then():
    capped = fewest_sensors(SCENE, 0.9, time_cap=1e-6, schedule=QUICK, voxel=0.1)
    assert not capped.reached
    assert capped.result.outcome is Outcome.TIME
    assert len(capped.tried) == 1


def test_what_cannot_be_is_refused():
    nowhere = Scene(limits={link: Limits(keep_out=((0.0, 1.0),)) for link in UR10.links})
    with pytest.raises(InfeasibleError, match="room for 0 rings"):
        fewest_sensors(nowhere, 0.5, schedule=QUICK)
    with pytest.raises(ValueError, match="not in"):
        fewest_sensors(SCENE, 1.0)
