"""Swapped ports: said with the ring that each belongs to, by serial numbers, by the number of
sensors, by a hand, and by what the sensors see.
"""

from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.loader import read_proposal
from place_rings.objectives.verify import Verifier
from place_rings.rig.check.port_matching import by_lines, by_pattern
from place_rings.rig.check.preconditions import require_ports
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.poses.clear import drawn
from place_rings.rig.rings.protocol import Counts
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.world import World
from place_rings.simulation.twin.noise import Noise

from ..support.refusals import refused
from .cell import SCENE
from .cell import SETUP as UNLIKE
from .tape import about_file, assessed, record

ALIKE = Setup((Ring("forearm", 0.4, 8, 0.4, 0.0, 0.08), Ring("tool", 0.0, 8, 0.0, 0.0, 0.08)))
A, B = 0xAAAA000000000001, 0xBBBB000000000002
NAMES = [f"{A:016X}", f"{B:016X}"]


def known(setup, serials=NAMES):
    """The setup with the serial numbers of its boards."""
    rings = (replace(r, serial=s) for r, s in zip(setup.rings, serials, strict=True))
    return Setup(tuple(rings))


def checked_after(tmp_path, setup, wave=False, mount=False, **more):
    """The assessment of a check whose two ports are swapped unless ``ports`` says otherwise."""
    stops = planned(SCENE, setup, poses=10, frames=8, candidates=30) if mount else None
    asked = about_file("two", SCENE, setup, stops, [], faults="none", wave=wave)
    return assessed(*record(tmp_path / "file", asked, **{"ports": (1, 0), **more}))


def swapped(result):
    """The reason that says that the two ports are swapped, with the ring of each."""
    said = [r for r in result.reasons if all(f"port {i}" in r for i in (0, 1))]
    for one in said:
        order = [one.index(word) for word in ("port 0", "forearm", "tool", "port 1")]
        assert order == sorted(order)
    return said


def test_ports_of_known_boards_are_told_apart_by_their_hellos(tmp_path):
    r = checked_after(tmp_path, known(ALIKE), serials=(A, B)).result
    assert len(swapped(r)) == 1
    assert [line.serial for line in r.lines] == NAMES[::-1]
    (tmp_path / "right").mkdir()
    r = checked_after(tmp_path / "right", known(ALIKE), serials=(A, B), ports=(0, 1)).result
    assert not swapped(r)


def test_rings_of_different_sizes_are_told_apart_without_hellos(tmp_path):
    r = checked_after(tmp_path, UNLIKE).result
    assert len(swapped(r)) == 1
    assert [line.serial for line in r.lines] == [None, None]


def test_a_hand_tells_which_ring_a_port_belongs_to(tmp_path):
    r = checked_after(tmp_path, ALIKE, wave=True).result
    assert len(swapped(r)) == 1
    assert not any(one.missed for one in r.self_check.waved)


def test_what_rings_see_of_robot_and_cell_tells_their_ports_and_the_rest_is_judged(tmp_path):
    found = checked_after(tmp_path, ALIKE, mount=True, serials=(A, B))
    r = found.result
    assert swapped(r) == r.reasons
    assert all(not one.faults for one in r.mount.rings)
    (tmp_path / "built.toml").write_text(found.parts.built.toml("two", Verifier(SCENE, 0.1)))
    setup, *_ = read_proposal(tmp_path / "built.toml")
    assert [ring.serial for ring in setup.rings] == NAMES  # each with its own board


def test_another_board_than_the_proposals_is_named(tmp_path):
    setup = known(ALIKE, (NAMES[0], "CCCC000000000003"))
    r = checked_after(tmp_path, setup, serials=(A, B), ports=(0, 1)).result
    (reason,) = r.reasons
    assert all(part in reason for part in ("ring 1 (tool)", NAMES[1], "CCCC000000000003"))


@pytest.mark.parametrize("seed", range(2))
def test_badly_mounted_rings_at_their_own_ports_are_not_called_swapped(seed):
    plan, done = planned(SCENE, ALIKE, 8, candidates=30), injected(SCENE, ALIKE, seed)
    rng = np.random.default_rng(seed)
    readings = done.world(SCENE).readings(rng, plan.joints, 5)
    assert by_pattern(SCENE, ALIKE, at_stops(readings, ALIKE, plan.joints)) == {}
    crossed = replace(readings, ring=1 - readings.ring)
    assert by_pattern(SCENE, ALIKE, at_stops(crossed, ALIKE, plan.joints)) == {0: 1, 1: 0}


@pytest.mark.parametrize("turned", [(0,), (0, 1)])
def test_rings_of_a_link_that_are_mounted_the_other_way_round_are_not_called_swapped(turned):
    """Each then looks as the other one of its link should."""
    ends = (Ring("forearm", 0.1, 16, 0.5, 0.0, 0.08), Ring("forearm", 0.9, 16, -0.5, 0.0, 0.08))
    pair, rng = Setup(ends), np.random.default_rng(0)
    rings = [replace(r, tilt=-r.tilt) if i in turned else r for i, r in enumerate(ends)]
    seat = [np.arange(16) * (-1 if i in turned else 1) % 16 + 16 * i for i in (0, 1)]
    world = World(SCENE, Setup(tuple(rings)), np.concatenate(seat), np.zeros(2), Noise())
    joints = drawn(SCENE, 24, 1)
    readings = world.readings(rng, joints, 5)
    assert by_pattern(SCENE, pair, at_stops(readings, pair, joints)) == {}
    crossed = replace(readings, ring=1 - readings.ring)
    assert by_pattern(SCENE, pair, at_stops(crossed, pair, joints)) == {0: 1, 1: 0}


def test_ports_are_refused_before_a_check_with_the_options_to_give():
    counts = [Counts(frames=5), Counts(frames=5)]
    require_ports(known(ALIKE), counts, ["/dev/x", "/dev/y"])
    counts[0].serials[NAMES[1]] += 1
    counts[1].serials[NAMES[0]] += 1
    with refused("--ring tool=/dev/x --ring forearm=/dev/y"):
        require_ports(known(ALIKE), counts, ["/dev/x", "/dev/y"])
    counts[1].serials[NAMES[1]] += 1  # two rings on its line: nothing is sure
    assert by_lines(known(ALIKE), counts) == {0: 1}
    assert by_lines(ALIKE, counts) == {}
