"""Electronics of rings: what a ring carries bounds the search, and search, wiring, firmware, power
plan and report state the same figures."""

import math
import re
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.electronics.controllers import CONTROLLERS
from place_rings.coverage.electronics.drivers import DRIVERS, driver
from place_rings.coverage.electronics.electronics import Electronics, most_on_ring
from place_rings.coverage.electronics.ring_bus import MOST_SENSORS
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.formats.firmware.power_plan import _GAUGES, power_plan
from place_rings.formats.firmware.sketch import sketch
from place_rings.formats.firmware.wiring import FEED_V, plan_ring, plan_setup
from place_rings.formats.schema.written_models import RequirementModel, VerdictModel
from place_rings.objectives.feasibility.board_fit import unwired
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.options import ReportOptions
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError
from place_rings.placement.space.starts import fresh
from place_rings.reporting.setup_report.bill_of_materials import materials
from place_rings.reporting.setup_report.cable_section import cable_section
from place_rings.reporting.setup_report.facts import Facts
from place_rings.reporting.setup_report.verdicts import overall, verdicts
from place_rings.simulation.safety import motion_of
from place_rings.simulation.safety_options import SafetyOptions

from ..support.refusals import refused

DRIVEN = sorted(name for one in DRIVERS.values() for name in one.models)
UNDRIVEN = sorted({*MODELS} - {*DRIVEN})
ELECTRONICS = st.builds(
    Electronics,
    rate_hz=st.none() | st.integers(10, 100),
    bus=st.sampled_from(["auto", "direct", "multiplexer"]),
    controller=st.sampled_from(sorted(CONTROLLERS)),
)


@settings(max_examples=15)
@given(ELECTRONICS, st.sampled_from(DRIVEN), st.floats(0.04, 0.2))
def test_a_ring_is_wired_up_to_the_largest_number_and_not_beyond(electronics, model, radius):
    """The time on the bus by its own closed form: nine clocks a byte, at most 80 % of the time."""
    sensor = pr.sensors[model]
    most = most_on_ring(electronics, sensor, radius)
    for count in {1, 2, 3, 6, 12, most, most + 1, MOST_SENSORS} - {0, MOST_SENSORS + 1}:
        ring = Ring("forearm", 0.5, count, 0.0, 0.0, radius, sensor)
        if count > most:
            with refused(f"ring 0 {count}", error=ValueError):
                plan_ring("ring 0", ring, electronics)
            continue
        wiring = plan_ring("ring 0", ring, electronics)
        read = wiring.driver.bytes_of(sensor) * 9 / wiring.bus.hertz * count
        assert wiring.bus.busy == pytest.approx(read * wiring.rate_hz)
        assert wiring.bus.busy <= 0.8
        assert wiring.rate_hz == electronics.rate_hz or electronics.rate_hz is None
        assert 10 <= wiring.rate_hz <= MODELS[model].rate_hz
        assert wiring.regulator_a is None or 800 * wiring.regulator_a >= wiring.supply_ma


def numbers(pattern: str, text: str) -> list[float]:
    return [float(n.replace(",", "")) for n in re.findall(pattern, text)]


@pytest.mark.slow
@settings(max_examples=12)
@given(
    st.sampled_from(DRIVEN),
    st.none() | st.sampled_from([10, 12, 20]),
    st.sampled_from(["ur5e", "panda", "ur10"]),
    st.integers(0, 2**32 - 1),
)
def test_every_drawn_search_is_wired_powered_and_told_alike(model, rate, robot, seed):
    agrees(model, rate, robot, seed)


@pytest.mark.parametrize(("model", "rate"), [("vl53l5cx-4x4", None), ("vl53l5cx", 20)])
def test_every_design_of_a_search_is_wired_powered_and_told_alike(model, rate):
    agrees(model, rate, "ur5e", 0)


def agrees(model, rate, robot, seed):
    """Rates, bytes and currents, read from the pages, the sketch and the report."""
    electronics = Electronics(rate, controller=sorted(CONTROLLERS)[seed % 3])
    scene = pr.Scene(robot, sensor=pr.sensors[model], electronics=electronics)
    if all(unwired(scene, scene_ring(scene, link)) for link in scene.robot.links):
        with refused("electronics: 3", error=InfeasibleError):
            Space(scene, sensors=12)
        return
    space = Space(scene, sensors=12)
    setup = space.setup(fresh(space, np.random.default_rng(seed)))
    wirings = plan_setup(setup, electronics)
    plan = power_plan(scene, setup, wirings)
    assert not plan.fault
    assert len(wirings) == len(plan.rings) == len(setup.rings)
    bill = "\n".join(materials(replace(scene, rules=Rules(mount="free")), setup))
    cables = "\n".join(cable_section(scene, setup))
    for i, wiring in enumerate(wirings):
        files = {name.split("/")[1]: data.decode() for name, data in sketch(wiring).items()}
        page, config = files["WIRING.md"], files["ring_config.h"]
        said = re.search(r"(\d+) readings.*frames of (\d+) bytes: (\d+)", page)
        rate_hz, frame, second = map(float, said.groups())
        assert (rate_hz, frame) == (wiring.rate_hz, wiring.frame_bytes)
        assert second == rate_hz * frame
        assert numbers(r"PERIOD_MS = (\d+)", config) == [1000 // rate_hz]
        assert set(numbers(r"RING_RANGING_HZ (\d+)", config)) <= {rate_hz}
        row = re.search(rf"^\| {i} \| [^|]+ \| {wiring.count} \| (.*) \|$", bill, re.M)[1]
        hz, distances, per_second, sent = (float(n.replace(",", "")) for n in row.split(" | "))
        assert (hz, sent) == (rate_hz, second)
        assert per_second == distances * hz == wiring.count * wiring.zones * hz
        assert numbers(r"draw up to (\d+) mA", page) == [wiring.supply_ma]
        assert plan.rings[i].sensors_ma == wiring.supply_ma
        assert re.search(rf"^\| {i} \| (?:[^|]+\|){{3}} {wiring.rate_hz} \|", cables, re.M)
    total = math.fsum(w.count * w.driver.carrier.peak_ma for w in wirings)
    assert plan.sensors_ma == pytest.approx(total)
    assert f"{total:.0f} mA at 3.3 V" in cables


def scene_ring(scene, link):
    return Ring(link, 0.0, 3, 0.0, 0.0, scene.radius_of(link), scene.sensor_of(link))


@settings(max_examples=15)
@given(
    st.lists(st.tuples(st.sampled_from(DRIVEN), st.integers(1, 6)), min_size=1, max_size=8),
    st.sampled_from(sorted(ROBOTS)),
    st.sampled_from(sorted(CONTROLLERS)),
    st.data(),
)
def test_a_feed_carries_its_rings_within_its_drop(kinds, name, board, data):
    """The drop by Kirchhoff's laws on a ladder of resistors, solved as a linear system."""
    robot = ROBOTS[name]
    rings = []
    for model, count in kinds:
        link = data.draw(st.sampled_from(robot.links))
        sensor, place = pr.sensors[model], data.draw(st.floats(0, 1))
        count = min(count, most_on_ring(Electronics(controller=board), sensor, 0.08))
        rings.append(Ring(link, place, count, sensor=sensor))
    setup, scene = Setup(tuple(rings)), Scene(robot=robot, poses=(Pose(robot.rest),))
    wirings = plan_setup(setup, Electronics(controller=board))
    plan = power_plan(scene, setup, wirings)
    assert plan.sensors_ma == sum(w.supply_ma for w in wirings)
    for ring, wiring in zip(plan.rings, wirings, strict=True):
        assert ring.usb_ma <= 500
        fed = ring.regulator_a is not None
        assert fed == (ring.feed_ma > 0) == wiring.own_supply
    if not plan.feed_ma:
        assert plan.awg is None
        return
    fed = sorted((r for r in plan.rings if r.feed_ma), key=lambda r: r.cable_m)
    at = np.array([0.0, *(r.cable_m for r in fed)])
    ohm = 2 * _GAUGES[plan.awg][0] * np.diff(at)
    n = range(len(fed))
    below = np.array([[ohm[: min(i, j) + 1].sum() for j in n] for i in n])
    drop = (below @ np.array([r.feed_ma for r in fed]))[-1] / 1000
    assert plan.drop_v == pytest.approx(drop)
    assert plan.drop_v <= 0.05 * FEED_V
    assert plan.supply_a * 1000 >= plan.feed_ma
    watts = sum(r.sensors_ma for r in fed) * 3.3
    assert plan.feed_ma * FEED_V > watts  # a regulator has losses


@given(st.sampled_from([*UNDRIVEN, None]), ELECTRONICS)
def test_nothing_limits_a_ring_without_electrical_data(model, electronics):
    sensor = pr.Sensor() if model is None else pr.sensors[model]
    assert most_on_ring(electronics, sensor, 0.08) is None
    assert most_on_ring(replace(electronics, bus="own"), pr.sensors["vl53l5cx"], 0.08) is None
    ring = Ring("forearm", 0.5, 24, 0.0, 0.0, 0.08, sensor)
    assert unwired(Scene(electronics=electronics), ring) == ""


@pytest.mark.parametrize(
    ("table", "names"),
    [
        ("", "cell.toml electronics vl53l5cx 3 103 80 10 vl53l5cx-4x4"),
        ("rate_hz = 20\n", "electronics 20 15 vl53l5cx-4x4"),
        ('bus = "direct"\n', "electronics 3"),
    ],
)
def test_a_search_that_no_ring_can_carry_is_refused_before_it_starts(run, tmp_path, table, names):
    """The example of README in a cell of its own: eight by eight zones on rings of at least
    three."""
    scene = f'robot = "ur5e"\n[sensor]\nmodel = "vl53l5cx"\n[electronics]\n{table}'
    (tmp_path / "cell.toml").write_text(scene)
    code, out, err = run("--scene", "cell.toml", "--sensors", 32, "--out", tmp_path / "out")
    assert (code, out, err.count("\n")) == (2, "", 1)
    for part in names.split():
        assert part in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("rate_hz = 9", "electronics.rate_hz 9 10"),
        ("rate_hz = 12.5", "electronics.rate_hz 12.5"),
        ('bus = "spi"', "electronics.bus spi auto direct multiplexer own"),
        ('controller = "uno"', "electronics.controller uno pico"),
    ],
)
def test_electronics_of_a_file_are_checked(run, tmp_path, line, parts):
    (tmp_path / "cell.toml").write_text(f"[electronics]\n{line}\n")
    code, out, err = run("verify", "n1_8_0", "--scene", "cell.toml", "--voxel", "0.1")
    assert (code, out, err.count("\n")) == (2, "", 1)
    for part in ("cell.toml", *parts.split()):
        assert part in err


def facts(setup, scene, required=()):
    """Facts of a report without counts."""
    few = ([], [], 1, [], faults(scene, setup.rings), None, [])
    return Facts("mine", setup, scene, ReportOptions(voxel=0.05), {}, *few, [*required], ())


@settings(max_examples=15)
@given(
    st.lists(st.sampled_from([*DRIVEN, "tfmini", None]), min_size=1, max_size=3),
    st.integers(1, 10),
    st.sampled_from([None, 10, 20]),
    st.sampled_from(["auto", "own"]),
    st.sampled_from([None, 80.0, 90.0]),
)
def test_the_cover_decides_each_question_by_its_own_limits(models, count, rate, bus, low):
    """A ring that exceeds its limit fails, one without data is not known; both never pass."""
    electronics = Electronics(rate, bus)
    sensors = [pr.Sensor() if name is None else pr.sensors[name] for name in models]
    setup = Setup(tuple(Ring("forearm", 0.5, count, 0.0, 0.0, 0.08, s) for s in sensors))
    scene = Scene(electronics=electronics, rules=Rules(mount="free"))
    required = []
    if low is not None:
        percents = {"required_percent": 85.0, "low_percent": low, "high_percent": low + 1}
        required = [RequirementModel(target="V_S(0.5)", **percents, passes=low >= 85)]
    each = {v.question: v for v in verdicts(facts(setup, scene, required))}
    broken = faults(scene, setup.rings)  # rings without bodies may break other rules
    assert each["mountable"].state == ("fail" if broken else "not known")
    limits = [most_on_ring(electronics, s, 0.08) for s in sensors]
    over = [most is not None and count > most for most in limits]
    unknown = any(most is None for most in limits)
    assert each["wireable"].state == ("fail" if any(over) else "not known" if unknown else "pass")
    assert each["powered"].state == ("not known" if any(over) or unknown else "pass")
    covered = "not known" if low is None else "pass" if low >= 85 else "fail"
    assert each["covered"].state == covered
    if each["powered"].state == "pass":
        total = sum(count * driver(s).carrier.peak_ma for s in sensors)
        assert f"{total:.0f} mA" in each["powered"].figure
    states = {v.state for v in each.values()}
    assert overall(tuple(each.values())) == ("Fails." if "fail" in states else "Not decided.")
    assert overall((VerdictModel(question="covered", state="pass", figure=""),)) == "Passes."


@given(ELECTRONICS, st.sampled_from(sorted(MODELS)), st.integers(1, 8))
def test_safety_reacts_at_the_rate_of_the_wiring(electronics, model, count):
    sensor = pr.sensors[model]
    ring = Ring("forearm", 0.5, count, sensor=sensor)
    scene = Scene(electronics=electronics)
    options = SafetyOptions(latency=0.0)
    timing = motion_of(Setup((ring,)), scene, None, options).timing
    rate = MODELS[model].rate_hz if model in UNDRIVEN else 20  # 20 where none is known
    most = most_on_ring(electronics, sensor, 0.08)
    if most is not None and count <= most:
        rate = plan_ring("ring 0", ring, electronics).rate_hz
    np.testing.assert_allclose(timing.period, 1 / (rate or 20))
