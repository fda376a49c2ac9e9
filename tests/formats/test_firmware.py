"""Firmware of rings: pins, buses and drawings as laws over all boards, counts and sensors; sketches
that are compiled for each board and run on a simulated bus."""

import itertools
import re
from contextlib import suppress
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from place_rings.cli import app as command_line
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.formats.firmware.bus_load import MOST_MA, MOST_PF, RISE_NS
from place_rings.formats.firmware.controllers import CONTROLLERS, DEFAULT_CONTROLLER
from place_rings.formats.firmware.drivers import DRIVERS
from place_rings.formats.firmware.sketch import config
from place_rings.formats.firmware.wiring import plan_ring, plan_setup
from place_rings.formats.ring_frame import frame_length
from place_rings.objectives.scene import paper_scene
from place_rings.reporting.setup_report.bill_of_materials import materials
from place_rings.reporting.wiring_drawing import wiring_figure
from place_rings.rig.rings.protocol import Status

from ..support.rooms import ROOT
from ..support.simulated_firmware import CODES, COMPILER, HOST, build, run

COUNTS = range(1, 25)
# all drivers on pins, the most on pins and on one to three multiplexers, and one more
EDGES = {1, 2, 3, 5, 6, 8, 9, 16, 17, 24}
EACH_COUNT = pytest.mark.parametrize(
    "count", [n if n in EDGES else pytest.param(n, marks=pytest.mark.slow) for n in COUNTS]
)
SENSORS = {name: pr.sensors[name] for name in MODELS}
ZONED = {name for one in DRIVERS.values() if one.bytes_zone for name in one.models}
READ = {name for one in DRIVERS.values() for name in one.models} - ZONED
PLAIN = [name for name, one in DRIVERS.items() if not one.bytes_zone]
EACH_BOARD = pytest.mark.parametrize("board", CONTROLLERS.values(), ids=CONTROLLERS)
COMPILED = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
SILENT = 0.25  # s without a frame, after which the check takes a ring as silent


def ring(count, model="vl53l1x", radius=0.08):
    return Ring("forearm", 0.5, count, 0.0, 0.0, radius, SENSORS[model])


def planned(board, count, model="vl53l1x", radius=0.08, wiring="auto"):
    return plan_ring("ring 0 (forearm)", ring(count, model, radius), board, wiring)


def stated(board, name):
    """Numbers of a board's stand-in header, which is written from the facts of its chip."""
    text = (HOST / "boards" / board.name / "pins_arduino.h").read_text()
    found = re.search(rf"\b{name}(?:\[\])? = ({{[^}}]*}}|\d+)", text)
    return [int(n) for n in re.findall(r"\d+", found[1].replace("-1", ""))]


@EACH_BOARD
def test_each_pin_of_a_board_is_free_or_excluded_with_a_reason(board):
    pins = [pin for pin in (*board.left, *board.right) if isinstance(pin, int)]
    assert len(set(pins)) == len(pins)
    for pin in pins:
        known = (pin in board.lines, pin in (board.sda, board.scl), pin in board.excluded)
        assert sum(known) == 1, board.label(pin)
    assert set(board.lines) <= set(pins)
    assert all(len(reason) > 5 for reason in board.excluded.values())


@EACH_BOARD
def test_pins_agree_with_the_header_of_the_board(board):
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
            with pytest.raises(ValueError, match=rf"reads the sensor {model}; .*vl53l1x"):
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
        for segment in wiring.segments:
            assert segment.line.load_pf <= MOST_PF
            assert segment.line.sink_ma <= MOST_MA
            assert segment.line.rise_ns <= RISE_NS[wiring.hertz]
        assert 50 <= wiring.period_ms <= 100  # at least ten frames a second


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize(("model", "count"), [("vl53l5cx", 2), ("vl53l5cx-4x4", 6)])
def test_a_compiled_ring_of_zones_sends_what_each_zone_measures(tmp_path, board, model, count):
    """Each with as many sensors as one bus bears; the simulated zone z is z mm farther away."""
    wiring = planned(board, count, model)
    side = wiring.sensor.zones
    program = build(wiring, tmp_path)
    ran = run(program, wiring, [(500 + i, Status.VALID) for i in range(count)], seconds=30)
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
def test_a_sensor_with_zones_that_fails_never_silences_its_ring(tmp_path):
    wiring = planned(CONTROLLERS["pico"], 4, "vl53l5cx-4x4")
    readings = [(500, Status.VALID)] * 4
    events = ["at 20000 off 2", "at 21000 on 2"]
    ran = run(build(wiring, tmp_path), wiring, readings, events, seconds=30)
    assert ran.longest_s < SILENT
    assert ran.frames[-1].status.tolist() == [0, 0, Status.FAILED, 0]
    assert ran.frames[-1].clock > 20  # its clock starts with the first frame


@pytest.mark.parametrize(("model", "count"), [("vl53l5cx", 3), ("vl53l5cx-4x4", 8)])
def test_more_zones_than_one_bus_reads_ten_times_a_second_are_refused(model, count):
    line = rf"{count} sensors, auto: \d+ ms for one reading of all, allowed: 80"
    with pytest.raises(ValueError, match=line):
        planned(CONTROLLERS["pico"], count, model)


def test_a_bus_bears_what_its_parts_add_up_to():
    """By the formulas of UM10204, from each part on its own."""
    (bus,) = planned(CONTROLLERS["pico"], 3).segments
    cable = 0.3 + 1.2 * 2 * np.pi * 0.08 * 2 / 3
    assert bus.line.load_pf == pytest.approx(10 + 100 * cable + 3 * 20)
    conductance = 3 / 10e3 + (0 if bus.added is None else 1 / bus.added)
    assert bus.line.rise_ns == pytest.approx(
        np.log(0.7 / 0.3) * bus.line.load_pf / conductance / 1e3
    )
    sink = 2.9 * conductance + 3 * 2.4 / 10e3
    assert bus.line.sink_ma == pytest.approx(1e3 * sink)


@pytest.mark.parametrize(("count", "multiplexers"), [(8, 1), (16, 2), (24, 3)])
def test_rings_of_many_sensors_have_multiplexers(count, multiplexers):
    for board in CONTROLLERS.values():
        wiring = planned(board, count)
        assert wiring.channels == (8,) * multiplexers
        assert (multiplexers, "TCA9548A multiplexer board") in wiring.parts


@pytest.mark.long
@EACH_BOARD
@COMPILED
@EACH_COUNT
def test_a_compiled_ring_sends_what_its_sensors_measure(tmp_path, board, count):
    """Each board with each count (the others with -m slow), and each driver with each board on pins
    and on multiplexers; the frames, read by our own decoder, hold the simulated distances before
    and after a change."""
    rng = np.random.default_rng(count)
    models = sorted(READ)
    model = models[(count + list(CONTROLLERS).index(board.name)) % len(models)]
    wiring = planned(board, count, model)
    mm = rng.integers(1, 8000, (2, count))
    status = rng.choice([Status.VALID, Status.WEAK, Status.NO_TARGET], (2, count))
    codes = [
        list(zip(map(int, a), map(Status, b), strict=True)) for a, b in zip(mm, status, strict=True)
    ]
    program = build(wiring, tmp_path)
    first = run(program, wiring, codes[0], seconds=5)
    second = run(program, wiring, codes[1], seconds=5)
    for measured, a, b in zip((first, second), mm, status, strict=True):
        frame = measured.frames[-1]
        assert frame.status.tolist() == b.tolist()
        expected = np.where(b == Status.NO_TARGET, np.nan, a / 1000)
        np.testing.assert_allclose(frame.distance, expected, atol=1e-12)
        assert {measured.sda, measured.scl} == {board.sda, board.scl}
        assert measured.pins == set(wiring.pins[2:])
        assert measured.hertz == wiring.hertz
        assert measured.longest_s < SILENT
        counts = measured.counts
        assert (counts.lost, counts.corrupt, counts.restarts) == (0, 0, 0)
    frames = len(second.frames)
    assert frames >= 0.9 * 5000 / wiring.period_ms or model == "vl53l4cd"  # slower to start


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize("driver", PLAIN)
def test_no_reading_is_old_when_the_bus_is_busiest(tmp_path, board, driver):
    """All 24 distances change at once; within 0.2 s all frames have the new ones."""
    wiring = planned(board, 24, driver)
    readings = [(500 + i, Status.VALID) for i in range(24)]
    code = CODES[driver][Status.VALID]
    events = [f"at 4000 reading {i} {900 + i} {code}" for i in range(24)]
    ran = run(build(wiring, tmp_path), wiring, readings, events, seconds=5)
    before = [frame.distance for frame in ran.frames if 3.5 < frame.clock < 4]
    after = [frame.distance for frame in ran.frames if frame.clock > 4.2]
    np.testing.assert_allclose(before, [0.5 + np.arange(24) / 1000] * len(before))
    np.testing.assert_allclose(after, [0.9 + np.arange(24) / 1000] * len(after))
    assert len(before) >= 8
    assert len(after) >= 13


@COMPILED
@pytest.mark.parametrize(("count", "driver"), [(4, "vl53l1x"), (16, "vl53l0x"), (24, "vl53l1x")])
def test_a_sensor_that_fails_fails_alone_and_returns(tmp_path, count, driver):
    wiring = planned(CONTROLLERS["esp32-s3-devkitc-1"], count, driver)
    readings = [(500 + i, Status.VALID) for i in range(count)]
    events = ["at 3000 off 2", "at 4000 on 2"]
    ran = run(build(wiring, tmp_path), wiring, readings, events, seconds=12)
    failed = np.array([frame.status == Status.FAILED for frame in ran.frames])
    during = [frame.clock for frame, row in zip(ran.frames, failed, strict=True) if row[2]]
    late = np.array([frame.clock > 2.9 for frame in ran.frames])
    assert not failed[late][:, [i for i in range(count) if i != 2]].any()
    assert failed[late][:, 2].any()
    assert max(during) < 11  # it is tried again every 5 s
    assert not failed[-1].any()
    assert ran.longest_s < SILENT


@EACH_BOARD
@COMPILED
@pytest.mark.parametrize("driver", PLAIN)
def test_a_sensor_that_holds_the_bus_low_blocks_its_own_channel_only(tmp_path, board, driver):
    wiring = planned(board, 16, driver)
    readings = [(500 + i, Status.VALID) for i in range(16)]
    ran = run(build(wiring, tmp_path), wiring, readings, ["at 4000 stuck 5"], seconds=8)
    frame = ran.frames[-1]
    assert frame.clock > 7.5
    assert np.flatnonzero(frame.status == Status.FAILED).tolist() == [5]
    after = np.array([f.status for f in ran.frames if f.clock > 5])
    assert not np.delete(after == Status.FAILED, 5, axis=1).any()


@COMPILED
@pytest.mark.parametrize("count", [1, 8, 12])
def test_multiplexers_that_lose_their_channels_are_set_again(tmp_path, count):
    wiring = planned(CONTROLLERS["pico"], count, wiring="multiplexer")
    readings = [(500 + i, Status.VALID) for i in range(count)]
    ran = run(build(wiring, tmp_path), wiring, readings, ["at 3000 lost 0"], seconds=10)
    assert not (ran.frames[-1].status == Status.FAILED).any()


@COMPILED
def test_hardware_faults_and_absent_sensors_are_reported_as_failed(tmp_path):
    wiring = planned(CONTROLLERS["pico"], 8)
    readings = [(300, Status.FAILED if i == 3 else Status.VALID) for i in range(8)]
    ran = run(build(wiring, tmp_path), wiring, readings, ["at 0 off 6"], seconds=4)
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
def test_the_simulated_board_refuses_pins_that_are_taken(tmp_path, board, pins):
    wiring = replace(planned(CONTROLLERS[board], len(pins)), xshut=pins)
    program = build(wiring, tmp_path)
    with pytest.raises(AssertionError, match=r"fault: pin \d+"):
        run(program, wiring, [(100, Status.VALID)] * len(pins))


@COMPILED
def test_the_simulated_bus_refuses_two_sensors_at_one_address(tmp_path):
    wiring = planned(CONTROLLERS["pico"], 8)
    program = build(wiring, tmp_path)
    shared = replace(wiring, channels=(4, 4))
    with pytest.raises(AssertionError):  # the sketch never sees half of them
        assert not (
            run(program, shared, [(100, Status.VALID)] * 8).frames[-1].status == Status.FAILED
        ).any()
    direct = replace(planned(CONTROLLERS["pico"], 2), xshut=(2, 2))
    with pytest.raises(AssertionError, match="two sensors answer at one address"):
        run(build(direct, tmp_path), direct, [(100, Status.VALID)] * 2)


@COMPILED
@pytest.mark.parametrize(("board", "other"), [*itertools.permutations(CONTROLLERS, 2)])
def test_a_sketch_compiles_for_its_own_board_only(tmp_path, board, other):
    with pytest.raises(AssertionError, match="this sketch is for the"):
        build(planned(CONTROLLERS[board], 2), tmp_path, other)


def test_firmware_is_written_for_every_ring_and_single_sensor(tmp_path):
    one = MountedSensor("tool", (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), SENSORS["vl53l0x"])
    setup = Setup((ring(16), ring(3, "vl53l4cd")), (one,))
    written = pr.export(setup, pr.Scene(), to="firmware", board="pico", folder=tmp_path)
    folders = ["ring0_forearm", "ring1_forearm", "ring2_tool"]
    assert sorted({file.parent.name for file in written}) == folders
    for name, kind in zip(folders, ("VL53L1X", "VL53L4CD", "VL53L0X"), strict=True):
        assert (tmp_path / name / f"{name}.ino").is_file()
        assert (
            f"× {kind} on the Raspberry Pi Pico" in (tmp_path / name / "ring_config.h").read_text()
        )
        assert (tmp_path / name / "wiring.png").read_bytes().startswith(b"\x89PNG")
        page = (tmp_path / name / "WIRING.md").read_text()
        assert "GP4 | SDA" in page
        assert "names no model" not in page


def test_the_paper_s_sensor_is_read_as_a_vl53l1x_and_the_page_says_so(tmp_path):
    pr.export("n1_8_0", to="firmware", folder=tmp_path)
    page = (tmp_path / "ring0_upper_arm" / "WIRING.md").read_text()
    assert "names no model. This firmware is for the VL53L1X" in page
    assert CONTROLLERS[DEFAULT_CONTROLLER].title in page


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"board": "uno"}, 'board: found "uno", allowed: esp32-s3-devkitc-1, esp32-devkit, pico'),
        ({"wiring": "x"}, 'wiring: found "x", allowed: auto, direct, multiplexer'),
        (
            {"wiring": "direct"},
            "wiring: ring 0 (forearm): 16 sensors, direct: 417 pF on a line, allowed: 400;"
            " multiplexers bear more",
        ),
    ],
)
def test_what_cannot_be_wired_is_one_line_and_writes_nothing(tmp_path, keys, line):
    with pytest.raises(pr.InputError) as error:
        pr.export(Setup((ring(16),)), to="firmware", folder=tmp_path / "out", **keys)
    assert str(error.value) == line
    assert not (tmp_path / "out").exists()


def test_a_ring_that_gets_multiplexers_says_why(tmp_path, capsys, monkeypatch):
    words = ["place-rings", "export", "n1_8_0", "--to", "firmware", "--out", str(tmp_path)]
    monkeypatch.setattr("sys.argv", words)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    with suppress(SystemExit):
        command_line.main()
    assert capsys.readouterr().err.splitlines()[0] == (
        "ring 0 (upper_arm): 8 sensors on one bus: 4.2 mA through the pull-ups of a line,"
        " allowed: 3; it gets 1 multiplexer"
    )
    page = (tmp_path / "ring0_upper_arm" / "WIRING.md").read_text("utf-8")
    assert "Why multiplexers: 8 sensors on one bus: 4.2 mA" in page
    board = CONTROLLERS["pico"]
    assert planned(board, 4).note == planned(board, 8, wiring="multiplexer").note == ""


def test_names_of_links_cannot_leave_the_folder_or_the_comment():
    (wiring,) = plan_setup(Setup((replace(ring(4), link='../a\n"x\\'),)), CONTROLLERS["pico"])
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
        return "\n".join(materials(paper_scene(), setup, frame_length))

    text = bill(Setup((ring(16), ring(24), ring(4))))
    assert "| 3 | ESP32-S3-DevKitC-1 board |" in text
    assert "| 5 | TCA9548A multiplexer board |" in text
    assert "counts as a VL53L1X" not in text
    assert "counts as a VL53L1X" in bill(named_setup("n1_8_0"))
    assert "no firmware reads the sensor tfmini" in bill(Setup((ring(8, "tfmini"),)))


def boxes(figure):
    """Boxes of all texts, and all pieces of lines, in pixels."""
    FigureCanvasAgg(figure).draw()
    (ax,) = figure.axes
    texts = [text for text in ax.texts if text.get_text()]
    lines = [ax.transData.transform(line.get_xydata()) for line in ax.lines]
    pieces = [piece for line in lines for piece in itertools.pairwise(line)]
    return texts, [text.get_window_extent() for text in texts], pieces


@pytest.mark.long
@EACH_BOARD
@pytest.mark.parametrize("count", [1, 2, 5, 6, 8, 9, 13, 16, 24])
def test_no_line_of_a_drawing_crosses_a_text_and_no_texts_overlap(board, count):
    figure = wiring_figure(planned(board, count))
    texts, extents, pieces = boxes(figure)
    wide, high = figure.get_size_inches() * figure.dpi
    for text, box in zip(texts, extents, strict=True):
        assert min(box.x0, box.y0, wide - box.x1, high - box.y1) >= 0, text
        for (x0, y0), (x1, y1) in pieces:  # all are level or upright
            apart = max(x0, x1) < box.x0 or min(x0, x1) > box.x1
            apart |= max(y0, y1) < box.y0 + 1 or min(y0, y1) > box.y1 - 1
            assert apart, text
    for (one, a), (other, b) in itertools.combinations(zip(texts, extents, strict=True), 2):
        assert not (a.x0 < b.x1 and b.x0 < a.x1 and a.y0 + 1 < b.y1 and b.y0 + 1 < a.y1), (
            one,
            other,
        )
    names = {text.get_text() for text in texts}
    wiring = planned(board, count)
    assert {board.label(pin) for pin in wiring.pins} <= names
    assert {f"sensor {i}" for i in range(count)} <= names
