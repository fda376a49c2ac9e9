"""Firmware that fires in slots: sketches of several rings, compiled, run on boards whose clocks
differ, and held against the written schedule and the pairs that may disturb each other."""

import csv
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.electronics.controllers import CONTROLLERS
from place_rings.coverage.electronics.drivers import DRIVERS
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.firmware.ring_slots import slot_notes
from place_rings.formats.firmware.sketch import sketch
from place_rings.formats.firmware.wiring import plan_ring, plan_setup
from place_rings.objectives.firing.schedule import firing_schedule
from place_rings.objectives.firing.slots import GUARD_S
from place_rings.objectives.options import FiringOptions
from place_rings.objectives.scene import Scene
from place_rings.rig.rings.protocol import Status
from place_rings.rig.session.stop_conditions import RingWatch, StopRules

from ..support.simulated_firmware import CODES, COMPILER, build_files
from ..support.simulated_slots import EDGE_US, BoardClock, run_rings

COMPILED = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
PICO = pr.Electronics(controller="pico")
BEGUN = 2.5  # s, after which all sensors have started
PLAIN = {name: one.models[0] for name, one in DRIVERS.items() if not one.bytes_zone}


def scheduled(setup, electronics=PICO):
    scene = Scene.paper().replace(electronics=electronics)
    schedule = firing_schedule("own", setup, scene, FiringOptions())
    return schedule, dict(enumerate(plan_setup(setup, electronics, schedule)))


def conflicts(schedule):
    return [((p.ring, p.sensor), (p.other_ring, p.other_sensor)) for p in schedule.pairs]


def together(light, pairs, after=BEGUN):
    """Pairs of which both sensors range at some moment."""
    late = {key: spans[spans[:, 0] > after] for key, spans in light.items()}

    def meet(a, b):
        (begin, end), (other_begin, other_end) = late[a].T, late[b].T
        return ((begin[:, None] < other_end) & (other_begin < end[:, None])).any()

    return [(a, b) for a, b in pairs if meet(a, b)]


def facing_rings(model, count=5):
    """Two rings that see each other, each with overlapping beams."""
    sensor = pr.sensors[model]
    places = ((0.3, 0.5), (0.6, -0.5))  # along the link, and tilt
    return Setup(tuple(Ring("forearm", at, count, t, 0.0, 0.08, sensor) for at, t in places))


@pytest.mark.slow
@COMPILED
def test_exported_sketches_keep_to_the_written_schedule(tmp_path):
    """By the files alone: three rings, their schedule.csv, and the pairs of the command."""
    scene = pr.Scene(sensor=pr.sensors["vl53l1x"], electronics=PICO)
    setup = Setup.named("n1_16_25", scene.sensor)
    pr.export(setup, scene, to="firmware", scheduled=True, folder=tmp_path)
    with (tmp_path / "schedule.csv").open() as file:
        rows = [*csv.DictReader(file)]
    start = {(int(r["ring"]), int(r["sensor"])): float(r["start_s"]) for r in rows}
    last = rows[-1]
    cycle = float(last["start_s"]) + float(last["length_s"])
    record = pr.firing_schedule(setup, scene).record
    wirings = dict(enumerate(plan_setup(setup, PICO, record)))
    folders = sorted(file for file in tmp_path.iterdir() if file.is_dir())
    programs = {i: build_files(tmp_path, one.name, "pico") for i, one in enumerate(folders)}
    ran = run_rings(wirings, np.random.default_rng(0), programs=programs)
    assert together(ran.light, conflicts(record)) == []
    assert len(start) == 48
    edges = ran.edges[0]
    for key, spans in ran.light.items():
        begun = spans[(spans[:, 0] > BEGUN) & (spans[:, 0] < 6)][:, 0]
        since = begun - edges[np.searchsorted(edges, begun) - 1] - start[key]
        assert (since > -1e-4).all()
        assert (since < GUARD_S).all()
        np.testing.assert_allclose(np.diff(begun), cycle, atol=0.003)  # none is left out
        assert np.diff(begun).mean() == pytest.approx(1 / record.rate_hz, rel=0.002)
    for run in ran.runs.values():
        assert run.counts.lost == run.counts.corrupt == 0
        assert run.longest_s < 0.1 + 0.01
        assert (run.frames[-1].status == Status.VALID).all()


@COMPILED
@pytest.mark.parametrize("board", CONTROLLERS)
@pytest.mark.parametrize("driver", PLAIN)
def test_each_driver_keeps_to_its_slots_on_each_board(driver, board):
    electronics = pr.Electronics(controller=board)
    schedule, wirings = scheduled(facing_rings(PLAIN[driver]), electronics)
    assert len(schedule.groups) == 1
    for wiring in wirings.values():
        assert len(set(wiring.pins)) == len(wiring.pins)
        assert not set(wiring.pins) & set(wiring.controller.excluded)
    ran = run_rings(wirings, np.random.default_rng(1), seconds=8)
    assert together(ran.light, conflicts(schedule)) == []
    for run, wiring in zip(ran.runs.values(), wirings.values(), strict=True):
        assert run.pins == set(wiring.pins[2:])
        np.testing.assert_allclose(run.frames[-1].distance, (500 + np.arange(5)) / 1000)
    rates = [(spans[:, 0] > BEGUN).sum() / (8 - BEGUN) for spans in ran.light.values()]
    np.testing.assert_allclose(rates, schedule.rate_hz, rtol=0.15)


@COMPILED
def test_the_same_check_finds_pairs_where_all_range_at_once():
    setup = facing_rings("vl53l1x")
    schedule, _ = scheduled(setup)
    free = dict(enumerate(plan_setup(setup, PICO)))
    ran = run_rings(free, np.random.default_rng(0), seconds=4)
    assert together(ran.light, conflicts(schedule)) == conflicts(schedule) != []


@COMPILED
@pytest.mark.parametrize("seed", range(3))
def test_no_noise_failure_or_missing_edge_brings_two_together(seed):
    """Edges that are noise, edges that are missing, and a sensor that fails and comes back."""
    rng = np.random.default_rng(seed)
    schedule, wirings = scheduled(facing_rings("vl53l1x"))
    noise = [f"edge {at}" for at in sorted(rng.integers(3_000_000, 7_000_000, 30))]
    one = rng.integers(5)
    failing = [f"at 3000 off {one}", f"at 4500 on {one}"]
    ran = run_rings(wirings, rng, 8, {0: failing, 1: [*noise, *failing]}, drop=0.2)
    assert together(ran.light, conflicts(schedule)) == []


@COMPILED
def test_a_ring_without_its_clock_does_not_range_and_says_so():
    _, wirings = scheduled(facing_rings("vl53l1x"))
    lost = run_rings(wirings, np.random.default_rng(0), 6, edges_until=3.0)
    assert all(spans[:, 0].max() < 3.5 for (ring, _), spans in lost.light.items() if ring == 1)
    late = [frame for frame in lost.runs[1].frames if frame.clock > 4.5]
    assert len(late) > 10
    assert all((frame.status == Status.FAILED).all() for frame in late)
    assert (lost.runs[0].frames[-1].status == Status.VALID).all()


@COMPILED
def test_a_check_takes_no_ring_that_fires_in_slots_as_frozen_or_silent():
    """Distances change all the time while a joint turns: each frame has the latest readings."""
    schedule, wirings = scheduled(Setup.named("n2_16_25", pr.sensors["vl53l1x"]))
    assert schedule.period_s > 0.2
    code = CODES["vl53l1x"][Status.VALID]
    events = [
        f"at {ms} reading {i} {1000 + ms % 1997 + i} {code}"
        for ms in range(2000, 7000, 20)
        for i in range(16)
    ]
    run = run_rings({0: wirings[0]}, np.random.default_rng(0), 7, {0: events}).runs[0]
    watch = RingWatch(StopRules())
    frames = [frame for frame in run.frames if frame.clock > BEGUN]
    for frame in frames:
        q = np.full(6, np.radians(15) * frame.clock)
        assert watch.fault(frame, np.zeros(16), q) is None
    assert np.diff([frame.clock for frame in frames]).max() < 0.12


def test_where_one_slot_will_do_the_sketch_stays_as_it_is(tmp_path):
    setup = Setup((Ring("forearm", 0.5, 4, 0.0, 0.0, 0.08, pr.sensors["vl53l1x"]),))
    schedule, wirings = scheduled(setup)
    assert len(schedule.groups[0].slots) == 1
    (free,) = plan_setup(setup, PICO)
    assert sketch(wirings[0]) == sketch(free)
    assert not any("slots" in name for name in sketch(free))


def test_sensors_without_single_rangings_are_free_and_a_note_says_so(run, tmp_path):
    setup = facing_rings("vl53l5cx-4x4", 4)
    schedule, wirings = scheduled(setup)
    assert [wiring.slots for wiring in wirings.values()] == [None, None]
    (note,) = slot_notes(setup, schedule)
    assert "VL53L5CX" in note


def test_a_shared_clock_has_one_leader_and_a_pin_of_its_own_on_every_board():
    for board, count in ((b, n) for b in CONTROLLERS for n in (1, 3, 16, 24)):
        electronics = pr.Electronics(controller=board)
        wiring = plan_ring("ring", facing_rings("vl53l1x", count).rings[0], electronics)
        slots = scheduled(facing_rings("vl53l1x", 5))[1][0].slots
        assert replace(wiring, slots=slots).clock not in wiring.pins
    leads = [wiring.slots.leads for wiring in scheduled(facing_rings("vl53l1x"))[1].values()]
    assert leads == [True, False]


def test_latest_starts_leave_room_for_ranging_on_any_clock():
    _, wirings = scheduled(facing_rings("vl53l1x"))
    for slots in (wiring.slots for wiring in wirings.values()):
        for start, latest, end in zip(slots.starts_us, slots.latest_us, slots.ends_us, strict=True):
            assert start < latest < end - slots.ranging_us
        ends = [*slots.starts_us[1:], slots.cycle_us]
        assert all(a <= b for a, b in zip(slots.ends_us, ends, strict=True))


@COMPILED
def test_a_long_cycle_allows_for_clocks_that_differ_by_more():
    """Over four seconds, crystals 100 ppm apart differ by 0.4 ms."""
    schedule, wirings = scheduled(facing_rings("vl53l1x"))
    wirings = {
        i: replace(wiring, slots=replace(wiring.slots, cycle_us=4_000_000))
        for i, wiring in wirings.items()
    }
    for slots in (wiring.slots for wiring in wirings.values()):
        assert slots.sync_us >= 2 * EDGE_US + 1e-4 * slots.cycle_us
        for start, latest in zip(slots.starts_us, slots.latest_us, strict=True):
            assert start < latest
    clocks = {0: BoardClock(0.1, 5e-5), 1: BoardClock(0.2, -5e-5)}
    ran = run_rings(wirings, np.random.default_rng(0), 9, clocks=clocks)
    assert together(ran.light, conflicts(schedule)) == []
    assert all((spans[:, 0] > BEGUN).any() for spans in ran.light.values())
