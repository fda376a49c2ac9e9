"""A check of setups with single sensors: alone, and beside a ring."""

import re
from dataclasses import replace

import numpy as np
from place_rings.cli.options.rig import resolve_ports
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.targets.named import Shell
from place_rings.rig.check.actors import Helper, SimulatedHelper
from place_rings.rig.check.findings import missing
from place_rings.rig.check.options import CheckOptions
from place_rings.rig.check.part_results import PartResults
from place_rings.rig.check.planned_check import ring_names
from place_rings.rig.check.plans import plan_check
from place_rings.rig.check.report import page
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import places, plan_rod
from place_rings.rig.session.gathering import Gathered
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.world import DEAD

from ..support.refusals import refused
from .cell import SCENE as CELL
from .tape import about_file, record
from .tape import assessed as judged

SCENE = replace(CELL, targets=(Shell(0.25),))
PAD = MountedSensor("forearm", (0.0, 0.12, 0.2), (0.0, 1.0, 0.0), name="pad")
BARE = MountedSensor("forearm", (0.0, -0.12, 0.2), (0.0, -1.0, 0.0))
RING = Ring("forearm", 0.4, 8, 0.4, 0.0, 0.08)
ALONE, MIXED = Setup((), (PAD, BARE)), Setup((RING,), (PAD, BARE))


def about(setup, mount):
    plan = plan_rod(
        SCENE,
        setup,
        SCENE.targets[0].target,
        6,
        where=places(SCENE, SCENE.targets[0].target, Rod(), 0.1),
    )
    stops = planned(SCENE, setup, poses=10, frames=8, candidates=30) if mount else None
    return about_file("singles.toml", SCENE, setup, stops, [plan], voxel=0.05)


def assessed(file, setup, mute=()):
    """The assessment of a recorded check in which the sensors ``mute`` never answer."""
    file, checked = record(file, about(setup, bool(setup.rings)), mute)
    return checked, judged(file, checked)


def test_a_setup_without_rings_is_checked_to_its_end(tmp_path):
    checked, done = assessed(tmp_path / "tape.rig", ALONE)
    r = done.result
    assert (checked.injected.dead, r.verdict, r.mount) == (None, "as proposed", None)
    assert [one.answering for one in r.self_check.rings] == [1, 1]
    assert r.coverage[0].trials == 6
    assert "pad" in page(r, {})


def test_single_sensors_are_checked_beside_a_ring(tmp_path):
    checked, done = assessed(tmp_path / "tape.rig", MIXED, mute=[8])
    r, built = done.result, done.parts.built
    assert checked.injected.dead < 8
    assert r.mount.injected_found["dead sensor"]
    assert "sensor pad (forearm)" in r.self_check.silent
    assert built.setup.singles == MIXED.singles
    assert not built.alive[8]
    assert built.alive[9]
    assert r.mount.zeta[0].alive_percent < r.mount.zeta[0].built_percent
    assert any("sensor pad (forearm)" in line for line in built.text())


def test_a_simulated_rig_injects_faults_into_rings_only():
    for seed in range(20):
        assert (injected(SCENE, ALONE, seed).seat == [0, 1]).all()
        mixed = injected(SCENE, MIXED, seed)
        assert (mixed.seat[8:] == [8, 9]).all()
        assert (mixed.seat[:8] == DEAD).sum() == 1


def test_single_sensors_have_ports_of_their_own():
    assert ring_names(MIXED) == ["forearm.0", "pad", "forearm.1"]
    ports = resolve_ports(MIXED, ["pad=/dev/a", "2=/dev/b", "forearm.0=/dev/c"])
    assert [(p.name, p.count) for p in ports] == [("/dev/c", 8), ("/dev/a", 1), ("/dev/b", 1)]


def test_names_of_single_sensors_are_unique_and_come_before_numbers():
    one = MIXED.singles[0]
    alike = Setup((), tuple(replace(one, name=name) for name in ("a", "a", "a.0")))
    assert len(set(ring_names(alike))) == 3
    numbers = Setup((), tuple(replace(one, name=name) for name in ("x", "2", "1")))
    ports = resolve_ports(numbers, ["x=/dev/A", "2=/dev/B", "1=/dev/C"])
    assert [port.name for port in ports] == ["/dev/A", "/dev/B", "/dev/C"]


def test_a_check_of_single_sensors_plans_no_mount_check():
    options = CheckOptions(part=("self", "mount"), seconds=1.0, stops=4, trials=4, voxel=0.05)
    assert plan_check(ALONE, SCENE, options, moved=False).mount is None
    with refused("2 single sensors"):
        plan_check(ALONE, SCENE, replace(options, part=("mount",)), moved=False)


def test_a_hand_is_passed_over_single_sensors_too():
    asked = []
    helper = Helper(lambda words: not asked.append(words), MIXED, moves=False)
    assert all(helper.wave(i) for i in range(3))
    assert [words.partition(":")[0] for words in asked[:2]] == [
        "ring forearm.0",
        "sensor pad (forearm)",
    ]
    asked = about_file("singles", SCENE, MIXED, None, [])
    (line,), _ = missing(PartResults(asked, Gathered()), None, [])
    assert "0 of 3 " in line


def test_a_simulated_hand_leaves_a_lone_sensor_most_of_the_time(monkeypatch):
    """Its usual distance is the median of its readings, which must not be that to the hand."""
    from place_rings.rig.check import actors

    seats = []
    monkeypatch.setattr(actors.time, "sleep", lambda seconds: None)
    helper = SimulatedHelper.__new__(SimulatedHelper)
    helper._setup = ALONE
    helper._tell = lambda hand: seats.append(hand)
    assert helper.wave(0)
    assert np.mean([hand is not None for hand in seats]) < 0.5
    assert re.fullmatch(r"\[None, \[0, 0\], None\]", str(seats))
