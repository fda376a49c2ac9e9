"""Firmware of rings: pins, buses and drawings as laws over all boards, counts and sensors; sketches
that are compiled for each board and run on a simulated bus."""

import itertools
import re
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.electronics.bus_load import MOST_MA, MOST_PF, RISE_NS
from place_rings.coverage.electronics.controllers import CONTROLLERS, DEFAULT_CONTROLLER
from place_rings.coverage.electronics.drivers import DRIVERS
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.formats.firmware.sketch import config
from place_rings.formats.firmware.wiring import plan_ring, plan_setup
from place_rings.objectives.scene import Scene
from place_rings.reporting.setup_report.bill_of_materials import materials
from place_rings.reporting.wiring_drawing import wiring_figure
from place_rings.rig.rings.protocol import Status

from ..support.refusals import has_parts, refused
from ..support.rooms import ROOT
from ..support.simulated_firmware import CODES, COMPILER, HOST, build
from ..support.simulated_firmware import run as run_firmware

COUNTS = range(1, 25)
SENSORS = {name: pr.sensors[name] for name in MODELS}
ZONED = {name for one in DRIVERS.values() if one.bytes_zone for name in one.models}
READ = sorted({name for one in DRIVERS.values() for name in one.models} - ZONED)
PLAIN = [name for name, one in DRIVERS.items() if not one.bytes_zone]
EACH_BOARD = pytest.mark.parametrize("board", CONTROLLERS.values(), ids=CONTROLLERS)
COMPILED = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
PICO = pr.Electronics(controller="pico")
SILENT = 0.25  # s without a frame, after which the check takes a ring as silent


def ring(count, model="vl53l1x", radius=0.08):
    return Ring("forearm", 0.5, count, 0.0, 0.0, radius, SENSORS[model])


def planned(board, count, model="vl53l1x", radius=0.08, wiring="auto"):
    electronics = pr.Electronics(bus=wiring, controller=board.name)
    return plan_ring("ring 0 (forearm)", ring(count, model, radius), electronics)


def valid(count, first=500):
    return [(first + i, Status.VALID) for i in range(count)]


def stated(board, name):
    """Numbers of a board's stand-in header, which is written from the facts of its chip."""
    text = (HOST / "boards" / board.name / "pins_arduino.h").read_text()
    found = re.search(rf"\b{name}(?:\[\])? = ({{[^}}]*}}|\d+)", text)
    return [int(n) for n in re.findall(r"\d+", found[1].replace("-1", ""))]


@EACH_BOARD
def test_each_pin_of_a_board_is_free_or_excluded_and_agrees_with_its_header(board):
    pins = [pin for pin in (*board.left, *board.right) if isinstance(pin, int)]
    assert len(set(pins)) == len(pins)
    for pin in pins:
        known = (pin in board.lines, pin in (board.sda, board.scl), pin in board.excluded)
        assert sum(known) == 1, board.label(pin)
    assert set(board.lines) <= set(pins)
    assert all(len(reason) > 5 for reason in board.excluded.values())
    assert [board.sda] == stated(board, "SDA")
    assert [board.scl] == stated(board, "SCL")
    taken = {*stated(board, "BOARD_TAKEN"), *stated(board, "TX"), *stated(board, "RX")}
    assert not taken & {board.sda, board.scl, *board.lines}


@EACH_BOARD
@pytest.mark.parametrize("model", sorted({*MODELS} - ZONED))
def test_no_pin_is_used_twice_and_no_bus_bears_too_much(board, model):
    """For 1 to 24 sensors of the catalogue, on rings of several sizes."""
    for count, radius in itertools.product(COUNTS, (0.04, 0.08, 0.16)):
        if model not in READ:
            with refused(f"{model} vl53l1x", error=ValueError):
                planned(board, count, model, radius)
            continue
        wiring = planned(board, count, model, radius)
        assert len(set(wiring.pins)) == len(wiring.pins)
        assert not set(wiring.pins) & set(board.excluded)
        assert not {board.sda, board.scl} & {*wiring.xshut, wiring.reset}
        assert bool(wiring.xshut) != bool(wiring.channels)
        assert wiring.count == count == len(wiring.xshut or wiring.places)
        if wiring.xshut:  # all at once on one bus
            assert len({0x29, *wiring.addresses}) == count + 1
        else:
            assert len(set(wiring.places)) == count
            assert max(wiring.channels) <= 8
        for segment in wiring.bus.segments:
            assert segment.line.load_pf <= MOST_PF
            assert segment.line.sink_ma <= MOST_MA
            assert segment.line.rise_ns <= RISE_NS[wiring.bus.hertz]
        assert 50 <= wiring.period_ms <= 100  # at least ten frames a second


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize(("model", "count"), [("vl53l5cx", 2), ("vl53l5cx-4x4", 6)])
def test_a_compiled_ring_of_zones_sends_what_each_zone_measures(board, model, count):
    """Each with as many sensors as one bus bears; the simulated zone z is z mm farther away."""
    wiring = planned(board, count, model)
    side = wiring.sensor.zones
    ran = run_firmware(build(wiring), wiring, valid(count), seconds=20)
    edge = (2 * np.arange(side) + 1 - side) / side * np.tan(wiring.sensor.fov / 2)
    slant = np.sqrt(1 + edge[:, None] ** 2 + edge**2)
    zone = np.arange(side * side).reshape(side, side)
    mm = slant * (500 + np.arange(count)[:, None, None] + zone)
    zones = ran.frames[-1].zones
    assert zones.grid == (side, side, 1, True)
    assert (zones.status == Status.VALID).all()
    np.testing.assert_allclose(zones.mm[..., 0], mm, atol=0.51)
    np.testing.assert_array_equal(zones.sigma_mm[0, ..., 0], np.minimum(5 * zone, 255))
    np.testing.assert_array_equal(zones.signal[0, ..., 0], np.minimum(1000 * zone, 65535))
    assert ran.longest_s < SILENT
    assert ran.counts.lost == ran.counts.corrupt == 0
    sent = [frame for frame in ran.frames if frame.clock > ran.frames[0].clock]
    assert len(sent) >= 0.9 * (sent[-1].clock - sent[0].clock) * 1000 / wiring.period_ms


@COMPILED
def test_a_sensor_with_zones_that_fails_never_silences_its_ring():
    wiring = planned(CONTROLLERS["pico"], 4, "vl53l5cx-4x4")
    events = ["at 20000 off 2", "at 21000 on 2"]
    ran = run_firmware(build(wiring), wiring, [(500, Status.VALID)] * 4, events, seconds=30)
    assert ran.longest_s < SILENT
    assert ran.frames[-1].status.tolist() == [0, 0, Status.FAILED, 0]
    assert ran.frames[-1].clock > 20  # its clock starts with the first frame


@pytest.mark.parametrize(("model", "count"), [("vl53l5cx", 3), ("vl53l5cx-4x4", 8)])
def test_more_zones_than_one_bus_reads_ten_times_a_second_are_refused(model, count):
    with refused(f"{count} auto ms", error=ValueError):
        planned(CONTROLLERS["pico"], count, model)


def test_a_bus_bears_what_its_parts_add_up_to():
    """By the formulas of UM10204, from each part on its own."""
    (bus,) = planned(CONTROLLERS["pico"], 3).bus.segments
    cable = 0.3 + 1.2 * 2 * np.pi * 0.08 * 2 / 3
    assert bus.line.load_pf == pytest.approx(10 + 100 * cable + 3 * 20)
    conductance = 3 / 10e3 + (0 if bus.added is None else 1 / bus.added)
    rise = np.log(0.7 / 0.3) * bus.line.load_pf / conductance / 1e3
    assert bus.line.rise_ns == pytest.approx(rise)
    assert bus.line.sink_ma == pytest.approx(1e3 * (2.9 * conductance + 3 * 2.4 / 10e3))


@pytest.mark.parametrize(("count", "multiplexers"), [(8, 1), (16, 2), (24, 3)])
def test_rings_of_many_sensors_have_multiplexers(count, multiplexers):
    for board in CONTROLLERS.values():
        wiring = planned(board, count)
        assert wiring.channels == (8,) * multiplexers
        assert (multiplexers, "TCA9548A multiplexer board") in wiring.parts


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize("count", [1, 2, 3, 6, 17])
def test_a_compiled_ring_sends_what_its_sensors_measure(board, count):
    """Each driver on pins of each board; the frames, read by our own decoder, hold the simulated
    distances before and after a change."""
    rng = np.random.default_rng(count)
    model = READ[(count + list(CONTROLLERS).index(board.name)) % len(READ)]
    wiring = planned(board, count, model)
    mm = rng.integers(1, 8000, (2, count))
    status = rng.choice([Status.VALID, Status.WEAK, Status.NO_TARGET], (2, count))
    first, second = (
        list(zip(map(int, a), map(Status, b), strict=True)) for a, b in zip(mm, status, strict=True)
    )
    codes = CODES[wiring.driver.name]
    events = [f"at 4000 reading {i} {d} {codes[s]}" for i, (d, s) in enumerate(second)]
    ran = run_firmware(build(wiring), wiring, first, events, seconds=7)
    before = [frame for frame in ran.frames if frame.clock < 3.9][-1]
    for frame, a, b in zip((before, ran.frames[-1]), mm, status, strict=True):
        assert frame.status.tolist() == b.tolist()
        expected = np.where(b == Status.NO_TARGET, np.nan, a / 1000)
        np.testing.assert_allclose(frame.distance, expected, atol=1e-12)
    assert {ran.sda, ran.scl} == {board.sda, board.scl}
    assert ran.pins == set(wiring.pins[2:])
    assert ran.hertz == wiring.bus.hertz
    assert ran.longest_s < SILENT
    assert (ran.counts.lost, ran.counts.corrupt, ran.counts.restarts) == (0, 0, 0)
    slow = wiring.driver.name == "vl53l4cd"  # to start
    assert slow or len(ran.frames) >= 0.9 * 7000 / wiring.period_ms


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize("driver", PLAIN)
def test_the_busiest_bus_is_fresh_and_a_sensor_that_holds_it_low_blocks_its_own_channel_only(
    board, driver
):
    """All 24 distances change at once; within 0.2 s all frames have the new ones."""
    wiring = planned(board, 24, driver)
    code = CODES[driver][Status.VALID]
    events = [*(f"at 4000 reading {i} {900 + i} {code}" for i in range(24)), "at 5100 stuck 5"]
    ran = run_firmware(build(wiring), wiring, valid(24), events, seconds=9)
    before = [frame.distance for frame in ran.frames if 3.5 < frame.clock < 4]
    after = [frame.distance for frame in ran.frames if 4.2 < frame.clock < 5]
    np.testing.assert_allclose(before, [0.5 + np.arange(24) / 1000] * len(before))
    np.testing.assert_allclose(after, [0.9 + np.arange(24) / 1000] * len(after))
    assert len(before) >= 8
    assert len(after) >= 13
    assert ran.frames[-1].clock > 8.5
    assert np.flatnonzero(ran.frames[-1].status == Status.FAILED).tolist() == [5]
    stuck = np.array([frame.status for frame in ran.frames if frame.clock > 6.1])
    assert not np.delete(stuck == Status.FAILED, 5, axis=1).any()


@COMPILED
@pytest.mark.parametrize(("count", "driver"), [(3, "vl53l1x"), (17, "vl53l0x"), (24, "vl53l1x")])
def test_a_sensor_that_fails_fails_alone_and_returns(count, driver):
    wiring = planned(CONTROLLERS["esp32-s3-devkitc-1"], count, driver)
    events = ["at 3000 off 2", "at 4000 on 2"]
    ran = run_firmware(build(wiring), wiring, valid(count), events, seconds=12)
    failed = np.array([frame.status == Status.FAILED for frame in ran.frames])
    during = [frame.clock for frame, row in zip(ran.frames, failed, strict=True) if row[2]]
    late = np.array([frame.clock > 2.9 for frame in ran.frames])
    assert not failed[late][:, [i for i in range(count) if i != 2]].any()
    assert failed[late][:, 2].any()
    assert max(during) < 11  # it is tried again every 5 s
    assert not failed[-1].any()
    assert ran.longest_s < SILENT


@COMPILED
@pytest.mark.parametrize("count", [1, 8, 12])
def test_multiplexers_that_lose_their_channels_are_set_again(count):
    wiring = planned(CONTROLLERS["pico"], count, wiring="multiplexer")
    ran = run_firmware(build(wiring), wiring, valid(count), ["at 3000 lost 0"], seconds=10)
    assert not (ran.frames[-1].status == Status.FAILED).any()


@COMPILED
def test_hardware_faults_and_absent_sensors_are_reported_as_failed():
    wiring = planned(CONTROLLERS["pico"], 8)
    readings = [(300, Status.FAILED if i == 3 else Status.VALID) for i in range(8)]
    ran = run_firmware(build(wiring), wiring, readings, ["at 0 off 6"], seconds=4)
    assert np.flatnonzero(ran.frames[-1].status == Status.FAILED).tolist() == [3, 6]
    assert ran.longest_s < SILENT


@COMPILED
@pytest.mark.parametrize(
    ("board", "pins"),
    [
        ("esp32-s3-devkitc-1", (4, 5, 6, 7, 8)),  # SDA
        ("esp32-devkit", (4, 5, 6, 7, 8)),  # strapping, flash
        ("pico", (6, 7, 5, 8, 9)),  # SCL
        ("pico", (25, 26)),  # LED
    ],
)
def test_the_simulated_board_refuses_pins_that_are_taken(board, pins):
    wiring = replace(planned(CONTROLLERS[board], len(pins)), xshut=pins)
    with pytest.raises(AssertionError, match=r"pin \d+"):
        run_firmware(build(wiring), wiring, [(100, Status.VALID)] * len(pins))


@COMPILED
def test_the_simulated_bus_refuses_two_sensors_at_one_address():
    wiring = planned(CONTROLLERS["pico"], 8)
    shared = replace(wiring, channels=(4, 4))
    with pytest.raises(AssertionError):  # the sketch never sees half of them
        assert not (
            run_firmware(build(wiring), shared, valid(8)).frames[-1].status == Status.FAILED
        ).any()
    direct = replace(planned(CONTROLLERS["pico"], 2), xshut=(2, 2))
    with pytest.raises(AssertionError, match="address"):
        run_firmware(build(direct), direct, valid(2))


@COMPILED
@EACH_BOARD
def test_a_sketch_compiles_for_its_own_board_only(board):
    for other in CONTROLLERS.keys() - {board.name}:
        with pytest.raises(AssertionError, match=re.escape(board.title)):
            build(planned(board, 2), other)


def test_firmware_is_written_for_every_ring_and_single_sensor(tmp_path):
    one = MountedSensor("tool", (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), SENSORS["vl53l0x"])
    setup = Setup((ring(16), ring(3, "vl53l4cd")), (one,))
    written = pr.export(setup, pr.Scene(), to="firmware", board="pico", folder=tmp_path)
    folders = ["ring0_forearm", "ring1_forearm", "ring2_tool"]
    assert sorted({file.parent.name for file in written if file.name != "POWER.md"}) == folders
    for name, kind in zip(folders, ("VL53L1X", "VL53L4CD", "VL53L0X"), strict=True):
        assert (tmp_path / name / f"{name}.ino").is_file()
        assert f"{kind} on the Raspberry Pi Pico" in (tmp_path / name / "ring_config.h").read_text()
        assert (tmp_path / name / "wiring.png").read_bytes().startswith(b"\x89PNG")
        assert "GP4 | SDA" in (tmp_path / name / "WIRING.md").read_text()
    assert not any(wiring.assumed for wiring in plan_setup(setup, PICO))


def test_the_paper_s_sensor_is_read_as_a_vl53l1x_and_multiplexers_are_explained(run, tmp_path):
    code, _, err = run("export", "n1_8_0", "--to", "firmware", "--out", tmp_path / "out")
    assert code == 0
    why = "8 sensors on one bus: 4.2 mA"
    assert has_parts(err.splitlines()[0], f"(upper_arm) {why} 3 1")
    page = (tmp_path / "out" / "ring0_upper_arm" / "WIRING.md").read_text("utf-8")
    assert why in page
    assert "VL53L1X" in page
    assert CONTROLLERS[DEFAULT_CONTROLLER].title in page
    assert all(one.assumed for one in plan_setup(named_setup("n1_8_0"), PICO))
    board = CONTROLLERS["pico"]
    assert planned(board, 4).note == planned(board, 8, wiring="multiplexer").note == ""


@pytest.mark.parametrize(
    ("keys", "parts"),
    [
        ({"board": "uno"}, f"board 'uno' {' '.join(CONTROLLERS)}"),
        ({"wiring": "x"}, "wiring 'x' auto direct multiplexer"),
        ({"wiring": "direct"}, "wiring 0 (forearm) 16 direct 417 pF 400"),
    ],
)
def test_what_cannot_be_wired_is_one_line_and_writes_nothing(tmp_path, keys, parts):
    with refused(parts, error=pr.InputError):
        pr.export(Setup((ring(16),)), to="firmware", folder=tmp_path / "out", **keys)
    assert not (tmp_path / "out").exists()


def test_names_of_links_cannot_leave_the_folder_or_the_comment():
    (wiring,) = plan_setup(Setup((replace(ring(4), link='../a\n"x\\'),)), PICO)
    assert re.fullmatch(r"ring0_\w+", wiring.name)
    heading, *_ = config(wiring).split("#pragma once")
    assert all(line.startswith("// ") and "\\" not in line for line in heading.splitlines())


def test_the_page_has_the_tables_of_the_code():
    page = (ROOT / "docs" / "electronics.md").read_text("utf-8")
    for board in CONTROLLERS.values():
        lines = ", ".join(map(str, board.lines))
        sda, scl = board.label(board.sda), board.label(board.scl)
        assert f"| `{board.name}` | {board.title} | {sda} | {scl} | {lines} |" in page
        for reason in board.excluded.values():
            pins = ", ".join(str(pin) for pin, why in board.excluded.items() if why == reason)
            assert f"| {board.title} | {pins} | {reason} |" in page


def test_the_bill_of_materials_lists_boards_and_multiplexers():
    def bill(setup):
        return "\n".join(materials(Scene.paper(), setup))

    # too narrow for their boards, so that no solid is built for the bill
    text = bill(Setup((ring(16, radius=0.04), ring(24, radius=0.04), ring(4, radius=0.04))))
    assert "| 3 | ESP32-S3-DevKitC-1 board |" in text
    assert "| 5 | TCA9548A multiplexer board |" in text
    title = "a VL53L1X"
    assert title not in text
    assert title in bill(named_setup("n1_8_0"))  # assumed
    assert has_parts(bill(Setup((ring(8, "tfmini"),))).replace("\n", " "), "sensor tfmini")


@EACH_BOARD
@pytest.mark.parametrize("count", [1, 6, 9, 24])
def test_no_line_of_a_drawing_crosses_a_text_and_no_texts_overlap(board, count):
    wiring = planned(board, count)
    figure = wiring_figure(wiring)
    figure.draw_without_rendering()
    (ax,) = figure.axes
    texts = [text for text in ax.texts if text.get_text()]
    # left, bottom, right, top of each text, and both ends of each piece of a line, pixels
    boxes = np.array([text.get_window_extent().extents for text in texts])
    lines = [ax.transData.transform(line.get_xydata()) for line in ax.lines]
    pieces = np.array([piece for line in lines for piece in itertools.pairwise(line)])
    low, high = boxes[:, :2], boxes[:, 2:]
    assert low.min() >= 0
    assert np.all(high <= figure.get_size_inches() * figure.dpi)

    def touching(lows, highs):
        """Pairs with the texts; a pixel of touch above or below is allowed."""
        edge = np.array([0.0, 1.0])
        within = (lows[:, None] < high - edge) & (low + edge < highs[:, None])
        return np.argwhere(within.all(axis=2))

    crossed = touching(pieces.min(axis=1) - 1e-9, pieces.max(axis=1) + 1e-9)
    assert not len(crossed), {texts[i].get_text() for i in crossed[:, 1]}
    both = [(i, j) for i, j in touching(low, high) if i != j]
    assert not both, [(texts[i].get_text(), texts[j].get_text()) for i, j in both]
    names = {text.get_text() for text in texts}
    assert {board.label(pin) for pin in wiring.pins} <= names
    assert {f"sensor {i}" for i in range(count)} <= names
