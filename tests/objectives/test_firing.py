"""Firing schedules: no two sensors that disturb each other fire together, in little time."""

import csv
import json
import math
from itertools import combinations

import numpy as np
import place_rings as pr
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.electronics.frame_times import frame_times
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.objectives.firing.interference import interference, may_disturb
from place_rings.objectives.firing.schedule import firing_schedule
from place_rings.objectives.firing.slots import GUARD_S, FiringProblem, greedy, slots
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.options import FiringOptions
from place_rings.objectives.scene import Scene
from place_rings.simulation.safety import motion_of
from place_rings.simulation.safety_options import SafetyOptions

from ..strategies.rings import poses, setups
from ..strategies.scenes import CELLS
from ..strategies.singles import mixed_setups

FREE = Scene.paper()


def listed(setup, scene, reach):
    return interference(scene, setup, reach).conflicts(setup.sensors)


@settings(max_examples=20)
@given(setup=mixed_setups(6, 3), q=poses(), seed=st.integers(0, 2**32 - 1))
def test_a_pair_with_a_common_point_in_its_beams_is_listed(setup, q, seed):
    rng = np.random.default_rng(seed)
    scene, beams = FREE.replace(poses=q), sensor_cones(FREE.robot, setup, q)
    conflicts = listed(setup, scene, "overlap")
    for i in range(setup.sensors):
        points = beams.within(i, rng.random((300, 3)))
        meets = [j for j in range(setup.sensors) if (beams.part(points, j) <= 0).any() and j != i]
        assert conflicts[i, meets].all()


@settings(max_examples=20)
@given(setup=setups(6, 3), q=poses(), cell=CELLS, seed=st.integers(0, 2**32 - 1))
def test_a_pair_that_meets_on_a_body_is_listed(setup, q, cell, seed):
    """Points of a body that one sensor sees, and that lie in the other's angle at any distance."""
    rng = np.random.default_rng(seed)
    scene = FREE.replace(poses=q, obstacles=[Obstacle(f"b{i}", body=b) for i, b in enumerate(cell)])
    beams, conflicts = sensor_cones(FREE.robot, setup, q), listed(setup, scene, "reflection")
    for solid in cell:
        corners = np.unique(solid.edges.reshape(-1, 3), axis=0)
        points = rng.dirichlet(np.ones(len(corners)), 300) @ corners
        v = points[:, None] - beams.apex
        along = (v * beams.axis).sum(axis=2)
        lit = along >= np.cos(beams.half_angle) * np.linalg.norm(v, axis=2)
        seen = lit & (along <= beams.range_m)
        for i, j in combinations(range(setup.sensors), 2):
            if ((lit[:, i] & seen[:, j]) | (seen[:, i] & lit[:, j])).any():
                assert conflicts[i, j]


@given(setup=setups(6, 3), q=poses(), cell=CELLS)
@settings(max_examples=20)
def test_more_ways_to_meet_list_more_pairs(setup, q, cell):
    scene = FREE.replace(poses=q, obstacles=[Obstacle(f"b{i}", body=b) for i, b in enumerate(cell)])
    direct, overlap, all_ways = (
        listed(setup, scene, reach) for reach in ("direct", "overlap", "reflection")
    )
    assert (direct <= overlap).all()
    assert (overlap <= all_ways).all()


def test_a_mirror_of_a_floor_joins_beams_that_do_not_meet_in_the_air():
    """One sensor sees the floor at 1 m; another lights the same place from beyond its range."""
    near, far = Sensor(math.radians(10), 1.2), Sensor(math.radians(10), 0.5)
    down = pr.MountedSensor("base", (5, 0, 1), (0, 0, -1), near)
    aside = pr.MountedSensor("base", (6.5, 0, 1), (-1.5, 0, -1), far)
    setup = Setup((), (down, aside))
    floor = FREE.replace(obstacles=[Obstacle(floor=0.0)])
    assert not listed(setup, floor, "overlap").any()
    assert listed(setup, floor, "reflection").any()
    assert not listed(setup, FREE, "reflection").any()


def test_facing_sensors_disturb_each_other_beyond_their_range():
    beam = Sensor(math.radians(10), 0.5)
    facing = pr.MountedSensor("base", (0, 0, 1), (1, 0, 0), beam)
    back = pr.MountedSensor("base", (3, 0, 1), (-1, 0, 0), beam)
    turned = pr.MountedSensor("base", (3, 0, 1), (1, 0, 0), beam)
    assert listed(Setup((), (facing, back)), FREE, "direct").any()
    assert not listed(Setup((), (facing, turned)), FREE, "reflection").any()


def model(name, **more):
    """A sensor of a model of the user's own."""
    figures = {"ranges": [{"range_m": 1.0}], "source": "own", "fov_deg": 25.0}
    return adapter(Sensor).validate_python({"model": {"name": name, **figures, **more}})


def test_wavelengths_apart_and_immunity_disturb_nobody():
    near, other, unknown = (model("own", wavelength_nm=nm) for nm in (940.0, 850.0, None))
    immune = model("coded", immune=True)
    expected = [[1, 0, 1, 0], [0, 1, 1, 0], [1, 1, 1, 0], [0, 0, 0, 0]]
    assert may_disturb([near, other, unknown, immune]).astype(int).tolist() == expected
    same = [pr.MountedSensor("base", (0, 0, 1), (1, 0, 0), beam) for beam in (near, other, unknown)]
    meetings = interference(FREE, Setup((), tuple(same)))
    assert meetings.pairs.tolist() == [[0, 2], [1, 2]]
    assert meetings.unlike == 1


@st.composite
def problems(draw, most=7):
    count = draw(st.integers(1, most))
    edges = draw(st.lists(st.booleans(), min_size=count * count, max_size=count * count))
    upper = np.triu(np.reshape(edges, (count, count)), 1)
    ms = [draw(st.lists(st.sampled_from(of), min_size=count, max_size=count)) for of in (
        (20, 38, 67),
        (0, 1, 3),
        (0, 1, 2),
    )]  # fmt: skip
    ranging, transfer, ring = map(np.array, ms)
    return FiringProblem(upper | upper.T, ranging / 1000, transfer / 1000, ring)


def least_period(problem):
    """The shortest period of all partitions into slots, by trying all."""

    def tried(slot):
        k = len(slot)
        if k == len(problem):
            return sum(
                max(problem.ranging[s]) + max(np.bincount(problem.ring[s], problem.transfer[s]))
                for s in ([v for v in range(k) if slot[v] == n] for n in range(max(slot) + 1))
            )
        return min(
            tried([*slot, n])
            for n in range(max(slot, default=-1) + 2)
            if not any(problem.conflicts[k, v] for v in range(k) if slot[v] == n)
        )

    return tried([])


@settings(max_examples=20, deadline=None)
@given(problem=problems())
def test_slots_are_apart_and_no_longer_than_the_exact_ones(problem):
    result, least = slots(problem), least_period(problem)
    for slot in (result.slot, greedy(problem)):
        assert not (problem.conflicts & (slot[:, None] == slot)).any()
    assert result.period == pytest.approx(problem.durations(result.slot).sum())
    assert result.bound <= least + 1e-6
    assert result.period <= least + 1e-6
    assert problem.bound <= least + 1e-9


@settings(max_examples=15, deadline=None)
@given(setup=setups(8, 3), q=poses())
@example(setup=pr.Setup.named("n1_16_0"), q=np.zeros(6))
def test_quick_slots_of_setups_are_within_a_fifth_of_the_exact_ones(setup, q):
    conflicts, count = listed(setup, FREE.replace(poses=q), "overlap"), setup.sensors
    problem = FiringProblem(
        conflicts, np.full(count, 0.038), np.full(count, 0.00135), setup.ring_of_sensor
    )
    assert slots(problem, limit_s=0).period <= 1.2 * slots(problem).period + 1e-9


def test_rates_follow_from_slots_ranging_and_bus():
    """Two facing rings of VL53L1X by hand: 38 ms of ranging, 60 bytes of 9 bits at 400 kHz."""
    scene = pr.Scene(sensor=pr.sensors["vl53l1x"])
    result = firing_schedule("own", Setup.named("n2_16_25", scene.sensor), scene, FiringOptions())
    (group,) = result.groups
    for slot in group.slots:
        most = max(np.bincount([ring for ring, _ in slot.sensors]))
        assert slot.seconds == pytest.approx(0.038 + GUARD_S + most * 60 * 9 / 400_000)
    assert group.period_s == pytest.approx(sum(slot.seconds for slot in group.slots))
    assert {r.rate_hz for r in result.rings} == {1 / group.period_s}
    fired = [tuple(s) for slot in group.slots for s in slot.sensors]
    assert sorted(fired) == Setup.named("n2_16_25").labels
    assert group.period_s <= 1.2 * group.bound_s


def test_a_ring_that_nobody_disturbs_keeps_the_rate_of_its_bus():
    scene = pr.Scene(sensor=pr.sensors["vl53l1x"])
    ring = Ring("forearm", 0.5, 4, sensor=scene.sensor)
    result = firing_schedule("one", Setup((ring,)), scene, FiringOptions(rate=15))
    assert not result.pairs
    assert result.rate_hz == result.rings[0].free_hz == 20
    assert result.rings[0].holds
    assert result.affordable.counts == (4,)


def test_what_no_source_states_is_unknown_or_said_to_be_assumed():
    scene = pr.Scene()
    paper, own = (
        frame_times(scene.electronics, sensor, 8, 0.08)
        for sensor in (Sensor(), pr.sensors["vl53l4cx"])
    )
    assert paper.assumed
    assert own.assumed
    assert paper.transfer_s is own.transfer_s is own.start_s is None
    zones = frame_times(scene.electronics, pr.sensors["vl53l5cx"], 8, 0.08)
    assert not zones.assumed
    assert zones.fault
    assert zones.free_hz == pytest.approx(1 / (8 * 1520 * 9 / 400_000))
    assert zones.start_s == pytest.approx(8 * 86_000 * 9 / 400_000)


@settings(max_examples=10, deadline=None)
@given(setup=setups(8, 2), rate=st.sampled_from([3.0, 6.0, 9.0, 15.0, 30.0]))
def test_the_affordable_sensors_keep_the_rate(setup, rate):
    scene = FREE.replace(sensor=pr.sensors["vl53l1x"])
    setup = setup.with_sensors(lambda _: scene.sensor)
    most = firing_schedule("drawn", setup, scene, FiringOptions(rate=rate)).affordable
    if most.sensors:
        rings = (
            pr.Ring(r.link, r.position, n, r.tilt, r.phase, r.radius, r.sensor)
            for r, n in zip(setup.rings, most.counts, strict=True)
        )
        again = firing_schedule("fewer", Setup(tuple(rings)), scene, FiringOptions(rate=rate))
        assert all(r.holds for r in again.rings)
        assert again.sensors == most.sensors


def test_the_written_schedule_is_proven_by_points_in_beams(run, tmp_path):
    """From the files that commands write alone: the beams of those that fire together share no
    point, among points that are drawn here."""
    code, _, _ = run("schedule", "n2_16_25", "--sensor", "vl53l1x-short", "--out", "out")
    assert code == 0
    with (tmp_path / "out" / "schedule.csv").open() as file:
        rows = list(csv.DictReader(file))
    report = json.loads((tmp_path / "out" / "schedule.json").read_text())
    fired = {(int(r["ring"]), int(r["sensor"])): (r["group"], r["slot"]) for r in rows}
    assert len(rows) == len(fired) == report["sensors"] == 80
    beams = list(csv.DictReader(run("cones", "n2_16_25")[1].splitlines()))
    number = lambda keys: np.array([[float(b[k]) for k in keys] for b in beams])  # noqa: E731
    apex, axis = number(["apex_x", "apex_y", "apex_z"]), number(["axis_x", "axis_y", "axis_z"])
    slot = [fired[int(b["ring"]), int(b["sensor"])] for b in beams]
    half, range_m = math.radians(10), 1.2
    rng, met = np.random.default_rng(0), 0
    for i in range(len(beams)):
        depth = range_m * np.cbrt(rng.random(400))
        side = rng.normal(size=(400, 3))
        side -= (side @ axis[i])[:, None] * axis[i]
        side /= np.linalg.norm(side, axis=1)[:, None]
        wide = depth * math.tan(half) * np.sqrt(rng.random(400))
        points = apex[i] + depth[:, None] * axis[i] + wide[:, None] * side
        for j in range(len(beams)):
            v = points - apex[j]
            d = v @ axis[j]
            across = np.linalg.norm(v - d[:, None] * axis[j], axis=1)
            if i != j and ((d <= range_m) & (across <= d * math.tan(half))).any():
                met += 1
                assert slot[i] != slot[j], (beams[i], beams[j])
    assert met > 0


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--rate", "0"), "--rate"),
        (("--rate", "nan"), "--rate"),
        (("--reach", "far"), "--reach"),
    ],
)
def test_bad_options_are_one_line(run, words, named):
    code, _, err = run("schedule", "n1_8_0", *words)
    assert code == 2
    assert named in err
    assert err.count("\n") == 1


def test_the_command_prints_the_record_of_the_api(run):
    code, out, _ = run("schedule", "n1_8_0", "--rate", "15", "--json")
    assert code == 0
    said, ours = (
        json.loads(out),
        pr.firing_schedule("n1_8_0", rate=15).record.model_dump(mode="json"),
    )
    for record in (said, ours):
        record.pop("seconds")
    assert said == ours


def test_safety_reacts_at_the_rate_of_the_schedule(run):
    scene = pr.Scene(sensor=pr.sensors["vl53l1x"])
    setup = Setup.named("n1_8_0", scene.sensor)
    timing = motion_of(setup, scene, None, SafetyOptions(scheduled=True)).timing
    rates = [r.rate_hz for r in pr.firing_schedule(setup, scene).record.rings]
    assert timing.period == pytest.approx(np.repeat(1 / np.array(rates), 8))
    assert timing.period.max() > motion_of(setup, scene, None, SafetyOptions()).timing.period.max()
    code, _, err = run("safety", "n1_8_0", "--scheduled", "--rate", "20")
    assert code == 2
    assert "--rate" in err
    assert err.count("\n") == 1
