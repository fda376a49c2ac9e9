"""The firing schedule in a check: what it expects of each ring, and the faults that it names."""

import json
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.electronics.drivers import DRIVERS
from place_rings.coverage.electronics.ring_bus import LEAST_HZ
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.firmware.ring_pace import RingPace, ring_paces
from place_rings.formats.firmware.wiring import plan_setup
from place_rings.objectives.firing.schedule import firing_schedule
from place_rings.objectives.options import FiringOptions
from place_rings.rig.check.bag_log import write_bag
from place_rings.rig.check.check_data import CheckData
from place_rings.rig.check.options import CheckOptions
from place_rings.rig.check.report import page
from place_rings.rig.check.timing_check import (
    STEP_S,
    RingFrames,
    scheduled_paces,
    timing_check,
)
from place_rings.rig.recording.recording import RecordingReader
from place_rings.rig.rings.protocol import Status
from place_rings.rig.simulated.frame_pace import FramePace
from place_rings.rig.simulated_cell.ground_truth import late_s

from ..support.refusals import refused
from ..support.simulated_firmware import CODES, COMPILER
from ..support.simulated_slots import run_rings
from .cell import SCENE as CELL
from .commands import call, proposed, result_of
from .paced import frames_of, heard, recorded_check
from .tape import about_file

COMPILED = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
SCENE = pr.Scene.paper().replace(electronics=pr.Electronics(controller="pico"))
PLAIN = [one.models[0] for one in DRIVERS.values() if not one.bytes_zone]
SEEN_S = STEP_S + 0.02  # s; a difference that constant delays of 10 ms do not hide


def facing(model, counts):
    """Rings side by side on one link, tilted towards each other."""
    sensor = pr.sensors[model]
    return Setup(
        tuple(
            Ring("forearm", 0.2 + 0.2 * i, n, 0.5 - (i % 2), 0.0, 0.08, sensor)
            for i, n in enumerate(counts)
        )
    )


def paced(setup, scene=SCENE):
    return ring_paces(setup, scene, firing_schedule("", setup, scene, FiringOptions()))


FACING = st.builds(
    facing, st.sampled_from(PLAIN), st.lists(st.integers(2, 6), min_size=2, max_size=4)
)
SEEDS = st.integers(0, 999)


def judged(setup, paces, seed, faulty=None, **fault):
    """What is found of rings of which one is faulty, on boards whose clocks and delays differ."""
    rng = np.random.default_rng(seed)
    rings = [
        heard(
            frames_of(pace, group.count, rng, **(fault if i == faulty else {})),
            rng,
            delay=rng.uniform(0, 0.01),
            drift=rng.uniform(-5e-5, 5e-5),
            jitter=0.001,
        )
        for i, (pace, group) in enumerate(zip(paces, setup.groups, strict=True))
    ]
    return timing_check(setup, paces, rings)


def named(found):
    """The rings with faults."""
    return [ring.ring for ring in found if ring.faults]


@settings(max_examples=15)
@given(FACING, SEEDS)
def test_rings_that_keep_the_schedule_have_no_fault_even_if_frames_are_lost(setup, seed):
    paces = paced(setup)
    for lost in (0.0, 0.3):
        found = judged(setup, paces, seed, 0, lost=lost)
        assert named(found) == []
        assert [ring.open for ring in found] == [[]] * len(paces)
        for ring, pace in zip(found, paces, strict=True):
            assert ring.found_hz == pytest.approx(pace.rate_hz, rel=0.01)


@settings(max_examples=15)
@given(FACING, SEEDS, st.floats(0, 1), st.data())
def test_a_ring_out_of_step_is_named_with_its_delay_and_no_other_one(setup, seed, share, data):
    paces = paced(setup)
    group = next((p.slots.rings for p in paces if p.slots and p.slots.shared), ())
    assume(len(group) > 1)
    cycle = paces[group[0]].cycle_s
    assume(cycle > 2.2 * SEEN_S)
    faulty = data.draw(st.sampled_from(group[1:]))
    late = SEEN_S + share * (cycle - 2 * SEEN_S)
    found = judged(setup, paces, seed, faulty, late=late)
    assert named(found) == [faulty]
    wrapped = late - cycle * round(late / cycle)
    off = found[faulty].late_ms / 1000 - wrapped
    assert abs(off - cycle * round(off / cycle)) < 0.02
    assert found[faulty].outside == found[faulty].repeating == []
    assert found[faulty].reference != faulty


@settings(max_examples=15)
@given(FACING, SEEDS, st.sampled_from([0.7, 0.9, 1.1, 1.5]), st.data())
def test_a_ring_at_another_rate_is_named_with_it_and_no_other_one(setup, seed, slower, data):
    paces = paced(setup)
    faulty = data.draw(st.integers(0, len(paces) - 1))
    found = judged(setup, paces, seed, faulty, slower=slower)
    assert named(found) == [faulty]
    ring = found[faulty]
    assert ring.found_hz == pytest.approx(ring.wanted_hz / slower, rel=0.02)
    assert len(ring.faults) == 1


@pytest.mark.parametrize("model", PLAIN)
def test_expected_rates_follow_from_the_printed_schedule(model, tmp_path):
    """From the written record: a cycle has all slots of the group, and is no shorter than the
    ring's rate allows."""
    setup = facing(model, (5, 5, 3))
    scene = pr.Scene(sensor=pr.sensors[model], electronics=SCENE.electronics)
    pr.firing_schedule(setup, scene).save(tmp_path / "firing")
    record = json.loads((tmp_path / "firing" / "schedule.json").read_text())
    for ring, pace in enumerate(paced(setup, scene)):
        (group,) = (g for g in record["groups"] if ring in g["rings"])
        slots, rate = group["slots"], record["rings"][ring]["rate_hz"]
        if len(slots) > 1:
            assert pace.cycle_s == pytest.approx(1 / rate, abs=1e-6)
            assert pace.cycle_s > sum(slot["seconds"] for slot in slots) - 1e-6
            assert pace.cycle_s > slots[-1]["start_s"] + slots[-1]["seconds"] - 1e-6
        else:
            assert pace.rate_hz == pytest.approx(rate, rel=0.02)  # whole milliseconds
        frames = pace.rate_hz * pace.cycle_s
        assert frames == pytest.approx(round(frames))
        times = [FramePace(pace, 1).due(n) for n in range(4 * pace.frames + 1)]
        assert 1 / max(np.diff(times)) >= LEAST_HZ
        assert len(times) - 1 == pytest.approx(pace.rate_hz * (times[-1] - times[0]))


@settings(max_examples=25)
@given(FACING, SEEDS)
def test_each_sensor_has_one_new_reading_in_a_cycle_after_its_slot(setup, first):
    for pace, group in zip(paced(setup), setup.groups, strict=True):
        ring = FramePace(pace, group.count)
        cycle, frames = 1 + first, pace.frames
        numbers = range(cycle * frames + 1, (cycle + 1) * frames + 1)
        fresh = np.array([ring.fresh(n) for n in numbers])
        assert (fresh.sum(axis=0) == 1).all()
        if pace.slots is not None:
            sent = np.array([ring.due(n) for n in numbers])[fresh.argmax(axis=0)]
            end = cycle * pace.cycle_s + np.take(pace.slots.ends_us, pace.slots.slot) / 1e6
            assert (sent > end - 1e-6).all()
            assert (sent < end + pace.frame_s + 1e-6).all()


def test_sensors_outside_of_their_slots_are_named():
    """Two rings that have each other's sketch keep the step, but not their slots."""
    setup = Setup.named("n2_16_25", pr.sensors["vl53l1x"])
    paces = paced(setup)
    rng = np.random.default_rng(0)
    rings = [heard(frames_of(paces[i], 16, rng), rng) for i in (0, 2, 1, 3, 4)]
    found = timing_check(setup, paces, rings)
    first, other = (
        np.array([FramePace(paces[i], 16).fresh(n) for n in range(30, 30 + paces[i].frames)])
        for i in (1, 2)
    )
    same = (first == other).all(axis=0)
    assert not same.all()
    assert named(found) == [1, 2]
    for ring in found:
        assert abs(ring.late_ms) < 1000 * STEP_S
        assert not same[ring.outside].any()


def test_sensors_with_few_new_readings_are_named():
    setup = facing("vl53l1x", (6, 6))
    paces = paced(setup)
    rng = np.random.default_rng(0)
    rings = [heard(frames_of(pace, 6, rng, seconds=9.0), rng) for pace in paces]
    held = rings[1].distance.copy()
    new = np.arange(len(held)) // (4 * paces[1].frames) * (4 * paces[1].frames)
    held[:, 2] = held[new, 2]
    kept = RingFrames(**vars(rings[1]) | {"distance": held})
    found = timing_check(setup, paces, [rings[0], kept])
    assert (found[0].faults, found[1].repeating) == ([], [2])


def test_what_cannot_be_seen_is_open():
    setup = facing("vl53l1x", (6, 6))
    paces = paced(setup)
    rng = np.random.default_rng(0)
    one = heard(frames_of(paces[0], 6, rng), rng)
    other = heard(frames_of(paces[1], 6, rng, seconds=0.3), rng)
    deaf = RingFrames(**vars(one) | {"clocked": False})
    for frames in (other, deaf, heard([], rng)):
        found = timing_check(setup, paces, [one, frames])
        assert named(found) == []
        assert [len(ring.open) for ring in found] == [0, 1]


RECORDED = facing("vl53l1x", (6, 6, 6))


@pytest.mark.parametrize(
    ("fault", "word"),
    [({}, ""), ({"lost": 0.3}, ""), ({"late_s": 0.06}, "step"), ({"slower": 1.2}, "slow")],
)
def test_a_whole_check_names_the_fault_of_a_ring_and_nothing_else(fault, word, tmp_path):
    scene = CELL.replace(electronics=SCENE.electronics)
    paces = paced(RECORDED, scene)
    assert paces[2].slots.rings == (0, 1, 2)
    rng = np.random.default_rng(0)
    result = recorded_check(
        tmp_path / "paced.rig", scene, RECORDED, paces, rng, {2: dict(fault)}.items()
    )
    assert len(result.reasons) == bool(word)
    assert all(word in reason and "ring 2" in reason for reason in result.reasons)
    assert result.verdict == ("differs" if word else "as proposed")
    assert [line.lost > 0 for line in result.lines] == [False, False, "lost" in fault]
    assert len(result.timing) == 3
    page_of = page(result, {})
    assert "Firing schedule" in page_of
    unscheduled = recorded_check(tmp_path / "free.rig", scene, RECORDED, paces, rng, judge=False)
    assert (unscheduled.timing, unscheduled.reasons) == ([], [])


def test_files_of_a_rig_show_the_same_as_its_recording(tmp_path):
    pytest.importorskip("rosbags")
    scene = CELL.replace(electronics=SCENE.electronics)
    paces, rng, file = paced(RECORDED, scene), np.random.default_rng(0), tmp_path / "paced.rig"
    live = recorded_check(file, scene, RECORDED, paces, rng, {2: {"late_s": 0.06}}.items())
    data = CheckData.replayed(file, thinned=False)
    bag = write_bag(data.check, data.gathered, RecordingReader(file).epoch, tmp_path)[0]
    words = ["--joints", tmp_path / bag, "--part", "self", "--scheduled", "--out", tmp_path / "out"]
    assert call("check", proposed(tmp_path, RECORDED, scene), *words) == 1
    found = result_of(tmp_path / "out")
    assert named(found.timing) == named(live.timing) == [2]
    for here, there in zip(found.timing, live.timing, strict=True):
        assert here.late_ms == pytest.approx(there.late_ms, abs=5)
        assert here.found_hz == pytest.approx(there.found_hz, rel=0.01)
        assert here.seen == there.seen


def test_the_fault_of_the_simulated_rig_is_one_ring_that_lost_the_step():
    paces = paced(RECORDED)
    assert late_s(paces, "none") == late_s(paces, "random") == (0.0, 0.0, 0.0)
    assert late_s(paces, "late") == (0.0, 0.0, pytest.approx(0.4 * paces[2].cycle_s))
    alone = Setup(RECORDED.rings[:1])
    with refused("--injected late"):
        scheduled_paces(alone, SCENE, CheckOptions(scheduled=True, injected="late"))
    assert scheduled_paces(alone, SCENE, CheckOptions()) == ()


def test_a_sensor_that_no_firmware_reads_is_refused():
    scene = SCENE.replace(electronics=pr.Electronics(bus="own"))
    with refused("--scheduled", '"own"'):
        scheduled_paces(RECORDED, scene, CheckOptions(scheduled=True))


@pytest.mark.parametrize("wrong", ["rings", "sensors"])
def test_a_recording_with_paces_of_other_rings_is_refused(wrong):
    scene = CELL.replace(electronics=SCENE.electronics)
    paces = paced(RECORDED, scene)
    less = replace(paces[2].slots, slot=paces[2].slots.slot[:-1])
    others = {"rings": paces[:1], "sensors": (*paces[:2], RingPace(frame_ms=50, slots=less))}
    with pytest.raises((UserError, ValueError), match="paces"):
        about_file("paced", scene, RECORDED, None, [], paces=others[wrong])


@pytest.mark.slow
@pytest.mark.parametrize(("injected", "late"), [("none", []), ("late", [2])])
def test_a_simulated_rig_that_fires_in_slots_is_checked_live(injected, late, tmp_path):
    pytest.importorskip("rtde_control")
    scene = CELL.replace(electronics=SCENE.electronics)
    file, out = proposed(tmp_path, RECORDED, scene), tmp_path / "out"
    words = ["--rig", "sim", "--scheduled", "--injected", injected, "--part", "self"]
    assert call("check", file, *words, "--out", out) == len(late)
    result = result_of(out)
    assert (named(result.timing), len(result.reasons)) == (late, len(late))
    assert call("check", "--replay", out / "recording-1.rig", "--out", tmp_path / "again") == len(
        late
    )
    assert result_of(tmp_path / "again") == result


@pytest.mark.slow
@COMPILED
def test_compiled_sketches_keep_the_pace_and_a_sketch_of_another_ring_does_not():
    """Boards whose clocks differ, with readings that change all the time."""
    setup = Setup.named("n2_16_25", pr.sensors["vl53l1x"])
    schedule = firing_schedule("", setup, SCENE, FiringOptions())
    paces = ring_paces(setup, SCENE, schedule)
    wirings = dict(enumerate(plan_setup(setup, SCENE.electronics, schedule)))
    code = CODES["vl53l1x"][Status.VALID]
    change = [
        f"at {ms} reading {i} {1000 + ms * 7 % 97 + i} {code}"
        for ms in range(2000, 9000, 20)
        for i in range(16)
    ]
    begun = 2.5

    def found(wirings):
        rng = np.random.default_rng(0)
        ran = run_rings(wirings, rng, 9, dict.fromkeys(wirings, change))
        rings = []
        for i in range(len(paces)):
            frames = [frame for frame in ran.runs[i].frames if frame.clock > begun]
            times = ran.clocks[i].true(np.array([1e6 * frame.clock for frame in frames]))
            rings.append(RingFrames.of(frames, times - 5.0))
        return timing_check(setup, paces, rings)

    good = found(wirings)
    assert named(good) == []
    assert all(abs(ring.late_ms) < 8 for ring in good)
    assert [ring.seen for ring in good] == [16] * 5
    swapped = found({**wirings, 1: wirings[2], 2: wirings[1]})
    assert set(named(swapped)) == {1, 2}
    free = found({**wirings, 3: plan_setup(setup, SCENE.electronics)[3]})
    assert named(free) == [3]
    assert free[3].found_hz == pytest.approx(20, rel=0.01)
