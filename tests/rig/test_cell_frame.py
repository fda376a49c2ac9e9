"""A cell that is stated in a frame turned by 180° about z, as the pendant's Base is.

Public source: https://github.com/ros-industrial/universal_robot/issues/676.
"""

from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Setup
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.check.report import OPTIONAL
from place_rings.rig.mount.cell_frame import cell_is_turned, turned
from place_rings.rig.mount.mounting_error_model import LIMITS, moved
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.world import World

from .cell import FLOOR, SETUP, SHELLS
from .commands import call, result_of
from .tape import Tape, about_file, recording_of


def read(world, joints, seed):
    return at_stops(world.readings(np.random.default_rng(seed), joints, 8), SETUP, joints)


def test_a_cell_turned_twice_is_as_it_was():
    for one, other in zip(SHELLS.obstacles, turned(turned(SHELLS)).obstacles, strict=True):
        for key in ("normal", "offset", "edges"):
            np.testing.assert_array_equal(getattr(one.body, key), getattr(other.body, key))


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_turned_cell_is_told_from_any_wiring_and_mounting(stops, seed):
    rng = np.random.default_rng(seed)
    errors = rng.uniform(-1, 1, (2, 4)) * LIMITS
    rings = tuple(moved(SHELLS, r, e) for r, e in zip(SETUP.rings, errors, strict=True))
    for world in (World(SHELLS, Setup(rings)), injected(SHELLS, SETUP, seed).world(SHELLS)):
        assert not cell_is_turned(SHELLS, SETUP, read(world, stops.joints, seed))
    there = turned(SHELLS)
    for world in (
        World(there, Setup(rings)),
        injected(SHELLS, SETUP, seed, "turned").world(SHELLS),
    ):
        assert cell_is_turned(SHELLS, SETUP, read(world, stops.joints, seed))
    assert not cell_is_turned(there, SETUP, read(world, stops.joints, seed))


def test_a_cell_that_looks_the_same_when_turned_is_not_called_turned(stops):
    floor = replace(SHELLS, obstacles=(FLOOR,))
    assert not cell_is_turned(floor, SETUP, read(World(floor, SETUP), stops.joints, 0))
    none = replace(SHELLS, obstacles=())
    assert not cell_is_turned(none, SETUP, read(World(floor, SETUP), stops.joints, 0))


def test_a_check_in_a_turned_cell_says_so_and_builds_nothing(stops, tmp_path):
    asked = about_file(
        *("turned.toml", SHELLS, SETUP, stops, []), faults="turned", wave=False, seconds=None
    )
    checked = PlannedCheck.read("turned", asked.header)
    with recording_of(tmp_path / "turned.rig", asked) as recording:
        tape = Tape(recording, checked)
        tape.world = injected(SHELLS, SETUP, 0, "turned").world(SHELLS)
        for i, q in enumerate(checked.plans.mount.joints):
            tape.stand(q, "mount", i, 8)
        tape.say("ended", tape.now, why="")
    out = tmp_path / "out"
    assert call("check", "--replay", tmp_path / "turned.rig", "--out", out) == 1
    result = result_of(out)
    assert (result.verdict, result.cell_turned, result.mount) == ("differs", True, None)
    assert len(result.reasons) == 1
    assert {p.name for p in out.iterdir()} & set(OPTIONAL) == {"stops.csv"}
