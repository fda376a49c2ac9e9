"""A check from files alone: MCAP, bags of SQLite and CSV give the findings of the rig itself, and
whatever else a file holds is one line.
"""

import math
import re
import sqlite3
import tracemalloc
from dataclasses import replace
from unittest.mock import Mock

import lz4.frame
import numpy as np
import pytest
from backports import zstd
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType
from place_rings.cli.app import app
from place_rings.cli.runs import check, check_summary
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import robot
from place_rings.coverage.targets import Target
from place_rings.formats.errors import UserError
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Goal
from place_rings.rig.check.assessment import assess
from place_rings.rig.check.models import CheckResult
from place_rings.rig.check.offline import FileOptions, file_check
from place_rings.rig.check.planned_check import PlannedCheck, ring_names
from place_rings.rig.check.plans import Plans, plan_check, read_plans, write_plans
from place_rings.rig.check.procedure import skipped
from place_rings.rig.recording.recording import RecordingReader
from place_rings.rig.rings.protocol import ABSENT, Status
from place_rings.rig.session.gathering import replay
from place_rings.rig.simulated_cell.world import World
from place_rings.rig.sources import bags
from place_rings.rig.sources.files import RigFiles, read_files
from place_rings.rig.sources.names import STEPS, rig_names
from place_rings.rig.sources.standstills import standstills
from rosbags.rosbag2 import ReaderError, storage_mcap

from .bags import (
    JOINTS,
    POINTS,
    RANGE,
    START,
    TEXT,
    joint_state,
    range_,
    recorded_messages,
    text,
    write_mcap,
    write_sqlite,
    write_tables,
    zones,
)
from .cell import SETUP
from .tape import record
from .test_check import SCENE, about

ROBOT = SCENE.robot
CHAIN = ROBOT.chain.joints


def call(words):
    """Run a command; return its exit code."""
    try:
        app(words, exit_on_error=False, print_error=False, result_action="return_value")
    except SystemExit as end:
        return end.code
    return 0


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A whole check of a simulated rig: its folder with proposal and plans, the data that it
    gathered, and the result of the live check.
    """
    folder = tmp_path_factory.mktemp("rig")
    tape, checked = record(folder / "tape.rig", about())
    (folder / "small.toml").write_text(to_toml(ProposalFile.of(SETUP, SCENE)))
    write_plans(SCENE, checked.plans, folder)
    gathered = replay(RecordingReader(tape), checked.ports, checked.about.stale_s)
    return folder, gathered, assess(checked, gathered, 0.0).result


def findings(result):
    """What a check finds, without what only a simulated rig knows."""
    keys = ("verdict", "reasons", "self_check", "mount", "coverage")
    told = {key: result.model_dump()[key] for key in keys}
    for ring in told["mount"]["rings"]:
        ring.pop("region_holds")
        for error in ring["errors"]:
            error.pop("injected")
    told["mount"].pop("injected_found")
    for one in told["coverage"]:
        one.pop("true_percent")
    return told


def unlike(a, b, where=""):
    """Where two findings differ: numbers by more than the rounding of float32 does, or anything
    else.
    """
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return [each for key in a for each in unlike(a[key], b[key], f"{where}.{key}")]
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        pairs = enumerate(zip(a, b, strict=True))
        return [each for i, (x, y) in pairs for each in unlike(x, y, f"{where}[{i}]")]
    if isinstance(a, float) and isinstance(b, float):
        return [] if math.isclose(a, b, rel_tol=1e-3, abs_tol=2e-3) else [(where, a, b)]
    return [] if a == b else [(where, a, b)]


def written(folder, gathered, kind):
    """Write the data of a rig as files; return the options that name them."""
    if kind == "csv":
        write_tables(folder / kind, gathered, CHAIN)
        options = ("joints", "readings", "steps")
        return [word for o in options for word in (f"--{o}", str(folder / kind / f"{o}.csv"))]
    messages = recorded_messages(gathered, CHAIN)
    if kind == "sqlite":
        write_sqlite(folder / kind, messages)
        return ["--joints", str(folder / kind)]
    write_mcap(folder / f"{kind}.mcap", messages, CompressionType[kind.upper()])
    return ["--joints", str(folder / f"{kind}.mcap")]


def test_files_of_an_earlier_check_are_named(rig, tmp_path, capsys):
    *_, live = rig
    check_summary.tell(Mock(result=live), ["check.html"], tmp_path, False)
    assert "also holds" not in capsys.readouterr().out
    (tmp_path / "built.toml").write_text("")
    check_summary.tell(Mock(result=live), ["check.html"], tmp_path, False)
    assert "also holds files of an earlier check: built.toml" in capsys.readouterr().out
    check_summary.tell(Mock(result=live), ["check.html", "built.toml"], tmp_path, False)
    assert "also holds" not in capsys.readouterr().out


@pytest.mark.long
def test_a_check_from_files_alone_finds_what_the_live_check_found(rig, tmp_path):
    """As one test: its rig takes long to simulate."""
    folder, gathered, live = rig
    words = ["check", str(folder / "small.toml"), "--plan", str(folder), "--voxel", "0.05"]
    for kind in ("zstd", "sqlite", "csv"):
        files, out = written(tmp_path, gathered, kind), tmp_path / f"{kind}-out"
        assert call([*words, *files, "--out", str(out)]) == 1
        result = CheckResult.model_validate_json((out / "check.json").read_text())
        assert not result.simulated
        assert unlike(findings(result), findings(live)) == []
        assert [line.frames for line in result.lines] == [line.frames for line in live.lines]
        if kind != "csv":  # which has no clock of the sender
            for line, was in zip(result.lines, live.lines, strict=True):
                assert line.drift_ppm == pytest.approx(was.drift_ppm, abs=0.5)
            assert result.robot.drift_ppm == pytest.approx(live.robot.drift_ppm, abs=0.5)
        assert {p.name for p in out.iterdir()} >= {"check.html", "built.toml", "stops.csv"}
        # between its steps this rig told nothing
        assert {w.split(":")[0] for w in result.warnings} == {
            "joint states",
            "ring 0 (forearm)",
            "ring 1 (tool)",
        }


def test_a_stop_that_the_files_lack_has_a_reason(rig, tmp_path):
    """Nothing ended the check before it, as a live check without the stop would say."""
    folder, gathered, _ = rig
    notes, lacks = list(gathered.said), []
    for i, (_, note) in enumerate(notes):
        if note["what"] == "begin" and note["step"] == "mount" and note["number"] == 1:
            lacks = [i, i + 1]
    for without, why in (
        (lacks, {1: "no step in the files"}),
        ([i for i, (_, note) in enumerate(notes) if note["what"] in ("begin", "end")], None),
    ):
        said = [note for i, note in enumerate(notes) if i not in without]
        files = tmp_path / f"{len(said)}"
        write_tables(files, replace(gathered, said=said), CHAIN)
        paths = (files / f"{name}.csv" for name in ("joints", "readings", "steps"))
        options = FileOptions(*paths, folder, (), ("mount",), True, 0.05, 0)
        found = skipped(file_check("small", SETUP, SCENE, options).gathered.said, "mount")
        assert found == why or set(found.values()) <= {"no standstill there in the files"}


def test_a_mount_check_in_an_unknown_cell_says_so(rig, tmp_path):
    """A live check refuses to start; files may hold other parts that can be assessed."""
    _, gathered, _ = rig
    write_tables(tmp_path / "csv", gathered, CHAIN)
    paths = (tmp_path / "csv" / f"{name}.csv" for name in ("joints", "readings", "steps"))
    options = FileOptions(*paths, None, (), ("self", "mount"), False, 0.05, 0)
    done = file_check("small", SETUP, replace(SCENE, obstacles=()), options)
    result = assess(done.check, done.gathered, done.wall).result
    assert result.verdict == "unfinished"
    assert any("mount check: the scene has no obstacles" in reason for reason in result.reasons)


def opened(path, robot=ROBOT, setup=SETUP, readings=None, steps=None, pairs=()):
    """Read files as a check does."""
    rings = ring_names(setup)
    names = rig_names(setup, robot, rings, pairs)
    files = RigFiles.of(robot, names.steps, path, readings, steps)
    return read_files(files, setup, robot, names, rings)


def standing(seconds=2.0, rate=50, q=(0.1, -0.2, 0.3, -0.4, 0.5, -0.6), names=CHAIN):
    """A rig that stands still, each sensor at its own rate and distance, as messages."""
    told = []
    for n in range(int(seconds * rate)):
        time = START + n / rate
        told.append(("/joint_states", JOINTS, time, joint_state(time, names, q)))
        if n % 5 == 2:
            for ring, sensor in SETUP.labels:
                read = 0.5 + 0.1 * ring + 0.01 * sensor
                data = range_(time, f"tof_{ring}_{sensor}", read)
                told.append(("/tof", RANGE, time, data))
    return told


def mcap(folder, messages, **more):
    path = folder / "rig.mcap"
    write_mcap(path, messages, **more)
    return path


def refused(folder, messages, **more):
    """The one line that refuses a file."""
    with pytest.raises(UserError) as error:
        opened(mcap(folder, messages), **more)
    line = str(error.value)
    assert "\n" not in line
    assert line.startswith(("--map", str(folder)))
    return line


@pytest.mark.parametrize("compression", CompressionType)
def test_a_file_is_read_as_it_was_written(tmp_path, compression):
    data = opened(mcap(tmp_path, standing(), compression=compression)).gathered
    assert len(data.states) == 100
    np.testing.assert_allclose(data.states[0].q, [0.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    assert [ring for ring, _ in data.frames].count(0) == 20
    time, joints, ring, sensor, distance, status = data.rows(2)
    np.testing.assert_allclose(distance, 0.5 + 0.1 * ring + 0.01 * sensor, atol=1e-6)
    assert (len(time), set(status)) == (20 * 14, {Status.VALID})
    assert joints.shape == (len(time), 6)


@given(st.permutations(range(6)), st.booleans(), st.integers(0, 2))
def test_joints_are_told_by_name_in_any_order(tmp_path_factory, order, suffix, more):
    """With or without ``_joint``, beside joints of a gripper, and part by part."""
    q = np.arange(1, 7) / 10
    names = [CHAIN[i].removesuffix("_joint") + "_joint" * suffix for i in order]
    names += [f"finger_{i}" for i in range(more)]
    position = [*q[list(order)], *[9e9] * more]
    messages = [m for m in standing(0.2) if m[1] == RANGE]
    for n in range(3):
        time = START + n / 10
        messages.append(("/gripper", JOINTS, time, joint_state(time, ["finger_0"], [1.0])))
        messages.append(("/joint_states", JOINTS, time, joint_state(time, names, position)))
    folder = tmp_path_factory.mktemp("order")
    for state in opened(mcap(folder, messages)).gathered.states:
        np.testing.assert_array_equal(state.q, q)


@pytest.mark.parametrize(
    ("distance", "read"),
    [
        (1.5, (1.5, Status.VALID)),
        (math.inf, (math.nan, Status.NO_TARGET)),
        (4.01, (math.nan, Status.NO_TARGET)),
        (-math.inf, (0.0, Status.WEAK)),
        (0.01, (0.01, Status.WEAK)),
        (math.nan, (math.nan, Status.FAILED)),
        (-0.5, (math.nan, Status.FAILED)),
    ],
)
@pytest.mark.parametrize("variance", [None, 0.0])
def test_a_range_means_what_ros_says(tmp_path, distance, read, variance):
    some = [m for m in standing(0.5) if m[2] < START + 0.2 or m[1] == JOINTS]
    time = START + 0.3
    last = range_(time, "tof_0_3", distance, variance=variance)
    some.append(("/tof", RANGE, time, last))
    frame = [f for ring, f in opened(mcap(tmp_path, some)).gathered.frames if ring == 0][-1]
    assert int(frame.status[3]) == read[1]
    np.testing.assert_allclose(frame.distance[3], read[0], rtol=1e-6)
    assert (frame.status[[0, 1, 2, 4, 5, 6, 7]] == ABSENT).all()


@pytest.mark.parametrize(
    ("points", "distance", "status"),
    [
        ([(1.0, 0.2, 0.0), (0.6, 0.0, 0.8), (0.9, 0.0, 0.0)], 0.9, Status.VALID),
        ([(math.nan,) * 3, (0.0, 0.3, 0.4)], 0.5, Status.VALID),
        ([(math.nan,) * 3, (0.0, 0.0, 0.0)], math.nan, Status.NO_TARGET),
        ([], math.nan, Status.NO_TARGET),
    ],
)
def test_of_a_frame_of_zones_the_first_return_counts(tmp_path, points, distance, status):
    some = [m for m in standing(0.5) if b"tof_1_0" not in m[3]]
    times = (START + 0.1, START + 0.2)
    some += [("/zones", POINTS, time, zones(time, "/tof_1_0", points)) for time in times]
    some.sort(key=lambda message: message[2])
    frames = [f for ring, f in opened(mcap(tmp_path, some)).gathered.frames if ring == 1]
    here = [f for f in frames if f.status[0] != ABSENT]
    assert [int(f.status[0]) for f in here] == [status] * 2
    np.testing.assert_allclose([f.distance[0] for f in here], distance, rtol=1e-6)
    assert all(f.zones is None for f in frames)


def test_a_cloud_of_a_sensor_s_zones_keeps_them_row_by_row(tmp_path):
    points = [(0.0, 0.0, 0.5 + k / 100) for k in range(16)]
    points[5] = (math.nan,) * 3
    some = [m for m in standing(0.5) if b"tof_1_0" not in m[3]]
    time = START + 0.1
    some.append(("/zones", POINTS, time, zones(time, "/tof_1_0", points)))
    some.sort(key=lambda message: message[2])
    gathered = opened(mcap(tmp_path, some)).gathered
    (frame,) = [f for ring, f in gathered.frames if ring == 1 and f.zones]
    read = frame.zones.distance[0, ..., 0]
    np.testing.assert_allclose(np.delete(read, 5), [p[2] for p in np.delete(points, 5, 0)], 1e-3)
    assert read.shape == (4, 4)
    assert np.isnan(read[1, 1])
    assert (frame.zones.status[1:] == ABSENT).all()
    *_, distance, status = gathered.rows_with_zones(2)
    assert ((status != ABSENT).sum(axis=1) == 16).sum() == 1
    assert np.isfinite(distance).sum() == 15


def changed(kind, data, at=1.0):
    """The messages of a rig with one more of a kind."""
    topic = {JOINTS: "/joint_states", RANGE: "/tof", POINTS: "/zones", TEXT: STEPS}[kind]
    return sorted([*standing(), (topic, kind, START + at, data)], key=lambda m: m[2])


NAN, FAR = math.nan, 1e6
BROKEN = b"\0\1\0\0" + b"\xff" * 12


@pytest.mark.parametrize(
    ("kind", "data", "line"),
    [
        (JOINTS, joint_state(0, CHAIN, [0, 0, NAN, 0, 0, 0]), r"found elbow at nan rad, wanted"),
        (JOINTS, joint_state(0, CHAIN, [0, 0, FAR, 0, 0, 0]), r"elbow at 1e\+06 rad, wanted: a"),
        (JOINTS, joint_state(0, CHAIN, [0.1, -0.2, 1.3, -0.4, 0.5, -0.6]), r"elbow 1 rad from the"),
        (JOINTS, joint_state(0, CHAIN, [0.0] * 5), r"found 6 names and 5 positions, wanted"),
        (JOINTS, joint_state(0, CHAIN[:4], [0.0] * 4), r"wanted: also wrist_2, wrist_3; --map"),
        (JOINTS, joint_state(0, (*CHAIN, "elbow_joint"), [0.0] * 7), r"found a joint twice"),
        (JOINTS, BROKEN, r"found 16 bytes that are no such message, wanted: sensor_msgs/msg/Joi"),
        (RANGE, BROKEN, r'topic "/tof.* found 16 bytes that are no such message'),
        (POINTS, BROKEN, r"found 16 bytes that are no such message"),
        (TEXT, text("dance 3"), r"found the step .dance 3., wanted: self, wave N"),
        (TEXT, text("mount"), r"found the step .mount., wanted"),
        (TEXT, BROKEN, r"found 16 bytes"),
        (TEXT, zstd.compress(text("self")), r"in CDR; decompress the bag"),
    ],
)
def test_a_message_that_cannot_be_is_one_line(tmp_path, kind, data, line):
    assert re.search(line, refused(tmp_path, changed(kind, data)))


def cloud(**more):
    """A cloud of one point, damaged."""
    data = zones(0.0, "tof_1_0", [(1.0, 0.0, 0.0)])
    for before, after in more.values():
        assert data.count(before) == 1
        data = data.replace(before, after)
    return data


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (cloud(name=(b"x\0", b"a\0")), "found the fields a, intensity, y, z, wanted: x, y and z"),
        (cloud(rows=(b"\1\0\0\0" * 2 + b"\4", b"\x39\x30\0\0\1\0\0\0\4")), "12345 points"),
        (cloud(rows=(b"\1\0\0\0" * 2 + b"\4", b"\2\0\0\0\1\0\0\0\4")), "wanted: 2 rows of 16"),
    ],
)
def test_a_cloud_that_cannot_be_is_one_line(tmp_path, data, line):
    assert line in refused(tmp_path, changed(POINTS, data))


def test_what_a_file_lacks_is_one_line(tmp_path):
    told = standing()
    none = [m for m in told if m[1] != JOINTS]
    assert "joint states: found 0 states of ur10" in refused(tmp_path, none)
    named = [(*m[:3], joint_state(m[2], ["a", "b"], [0, 0])) if m[1] == JOINTS else m for m in told]
    assert "and the joints a, b, wanted: states of shoulder_pan" in refused(tmp_path, named)
    none = [m for m in told if m[1] == JOINTS]
    line = refused(tmp_path, none)
    assert "ring forearm: found no reading of its sensors, and of other frames: none" in line
    other = [(*m[:3], m[3].replace(b"tof_1_", b"abc_1_")) for m in told]
    line = refused(tmp_path, other)
    assert 'ring tool: found no reading of its sensors, and of other frames: "abc_1_0", ' in line
    assert "--map" in line
    assert opened(tmp_path / "rig.mcap", pairs=("tool=abc_1_{sensor}",)).gathered.frames
    late = [(*m[:2], m[2] + 60 * (m[1] == RANGE), m[3]) for m in told]
    assert "wanted: some between" in refused(tmp_path, late)
    slow = [m for m in told if m[1] != JOINTS or round(50 * (m[2] - START)) % 40 == 0]
    assert "found a state every 0.8 s, wanted: at least one every 0.5 s" in refused(tmp_path, slow)
    assert 'found "/chatter", wanted: a topic of' in refused(
        tmp_path, [("/chatter", TEXT, START, text("hello"))]
    )
    twice = [("/b", *m[1:]) if b"tof_0_3" in m[3] and m[2] > START + 1 else m for m in told]
    assert 'sensor tof_0_3: found the topics "/tof" and "/b", wanted: one' in refused(
        tmp_path, twice
    )


def test_a_bag_of_several_files_is_one_and_its_times_must_be_in_order(tmp_path):
    told = standing()
    for name, half in (("a", told[:100]), ("b", told[100:])):
        write_mcap(tmp_path / f"{name}.mcap", half)
    (tmp_path / "notes.txt").write_text("not read")
    data = opened(tmp_path).gathered
    assert (len(data.states), len(data.frames)) == (100, 40)
    write_mcap(tmp_path / "c.mcap", [("/chatter", TEXT, START, text("hello"))])
    assert len(opened(tmp_path).gathered.states) == 100
    (tmp_path / "a.mcap").rename(tmp_path / "c.mcap")
    with pytest.raises(UserError, match=r"c.mcap|found a time .* s before the last, wanted: times"):
        opened(tmp_path)
    for file in tmp_path.glob("*.mcap"):
        file.rename(f"{file}.zstd")
    with pytest.raises(UserError, match=r"found 0 files .* decompress the bag with zstd -d"):
        opened(tmp_path)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The bytes of a small MCAP file and of a small database."""
    folder = tmp_path_factory.mktemp("small")
    write_mcap(folder / "a.mcap", standing(0.3), chunk_size=2000)
    write_sqlite(folder / "bag", standing(0.3))
    return {
        ".mcap": (folder / "a.mcap").read_bytes(),
        ".db3": (folder / "bag" / "bag_0.db3").read_bytes(),
    }


def read_or_refused(path):
    line = f"{path}: found"
    try:
        assert opened(path).gathered.states
    except UserError as error:
        line = str(error)
    assert line.startswith(str(path))
    assert "\n" not in line


@given(st.sampled_from([".mcap", ".db3"]), st.floats(0, 1), st.integers(1, 255), st.booleans())
def test_a_damaged_file_is_read_or_refused_in_one_line(small, tmp_path_factory, kind, at, by, cut):
    data = bytearray(small[kind])
    place = int(at * (len(data) - 1))
    data[place] ^= by
    path = tmp_path_factory.mktemp("bad") / f"a{kind}"
    path.write_bytes(data[:place] if cut else data)
    if cut:
        with pytest.raises(
            UserError, match=r"found a damaged file .*, wanted: .* complete to its end"
        ):
            opened(path)
    read_or_refused(path)


@pytest.mark.parametrize("data", ["'text'", "9000000000000000000", "1.5", "x'00'"])
def test_a_database_of_other_values_is_refused_in_one_line(tmp_path, data):
    write_sqlite(tmp_path / "bag", standing(0.2))
    with sqlite3.connect(tmp_path / "bag" / "bag_0.db3") as database:
        database.execute(f"UPDATE messages SET data = {data} WHERE id = 20")
    database.close()
    with pytest.raises(UserError, match=r"topic .*: found a (str|int|float),|found 1 bytes that"):
        opened(tmp_path / "bag")


@given(st.sampled_from([".mcap", ".db3"]), st.binary(max_size=200))
def test_any_bytes_are_refused_in_one_line(tmp_path_factory, kind, data):
    path = tmp_path_factory.mktemp("any") / f"a{kind}"
    path.write_bytes(data)
    with pytest.raises(UserError, match="found a damaged file"):
        opened(path)


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_file_that_unpacks_to_much_more_than_it_says_is_refused(tmp_path, compression):
    path = mcap(tmp_path, standing(0.2), compression=CompressionType[compression.upper()])
    pack = {"lz4": lz4.frame.compress, "zstd": zstd.compress}[compression]
    bomb = pack(bytes(50_000_000))
    tracemalloc.start()
    unpack = bags._bounded(getattr(bags, f"_{compression}"))
    assert len(unpack(bomb, 1000)) == 1001
    with pytest.raises(ValueError, match="at most"):
        unpack(bomb, 1 << 30)
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()
    assert opened(path).gathered.states
    assert storage_mcap.decompress(pack(b"abc"), compression, 3, 0) == b"abc"
    with pytest.raises(ReaderError, match="size mismatch"):
        storage_mcap.decompress(bomb, compression, 1000, 0)


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ("", "line 1: found the columns nothing, wanted: one of t, time, time_s, timestamp"),
        ("time,range_m\n", "found the columns time, range_m, wanted"),
        ("time,sensor,range_m\n1,tof_0_0\n", "line 2: found 2 columns, wanted: 3"),
        ("time,sensor,range_m\nx,tof_0_0,1\n", 'line 2, column time: found "x", wanted: a number'),
        ("time,sensor,range_m\nnan,tof_0_0,1\n", "column time: found the time nan, wanted: 0 to"),
        ("time,sensor,range_m\n1,tof_0_0,far\n", 'column range_m: found "far", wanted'),
        ("time,sensor,range_m\n1,tof_0_0,612\n", "found 612.0, wanted: m, at most 65.535, or inf"),
        ("time,sensor,range_m\n2,tof_0_0,1\n1,tof_0_1,1\n", "1 s before the last of its ring"),
        ("time,sensor,range_m\n" + "1" * 9999, "line 2: found more than 4096 characters"),
        ("time,sensor,range_m\n1,tof_0_0,1\n", "ring tool: found no reading of its sensors"),
    ],
)
def test_a_table_that_cannot_be_is_one_line(tmp_path, table, line):
    joints, readings = tmp_path / "joints.csv", tmp_path / "readings.csv"
    rows = [",".join(["time", *CHAIN]), *(f"{n / 10},0,0,0,0,0,0" for n in range(1, 40))]
    joints.write_text("\n".join(rows))
    readings.write_text(table)
    with pytest.raises(UserError) as error:
        opened(joints, readings=readings)
    assert line in str(error.value)
    assert str(error.value).startswith(str(readings))


def test_a_time_out_of_order_is_named_in_full(tmp_path):
    rows = [",".join(["time", *CHAIN]), *(f"{START + t},0,0,0,0,0,0" for t in (0.5, 0.25))]
    (tmp_path / "joints.csv").write_text("\n".join(rows))
    with pytest.raises(UserError, match=r"allowed: above 1760000000\.5, the time of the row"):
        opened(tmp_path / "joints.csv", readings=tmp_path / "joints.csv")


@pytest.mark.parametrize(
    ("pair", "line"),
    [
        ("tof_0_3", "wanted: NAME=SOURCE, like tof_0_3=/left/range_3"),
        ("hand=x", "wanted: a joint (shoulder_pan, "),
        ("forearm=x", "wanted: a source with {sensor}, one name for each sensor"),
        ("tof_{ring}_{sensor}=x{sensor}", "wanted: a source with {sensor}"),
        ("tof_0_3=tof_0_4", "found one source for two sensors, wanted: one for each"),
    ],
)
def test_a_map_that_cannot_be_is_one_line(pair, line):
    with pytest.raises(UserError) as error:
        rig_names(SETUP, ROBOT, ring_names(SETUP), [pair])
    assert str(error.value).startswith("--map: ")
    assert line in str(error.value)


def test_names_in_the_files_may_be_others(tmp_path):
    """Topics instead of frames, a joint, and the topic of the steps."""
    told = [("/elsewhere", TEXT, START + 0.5, text("self"))]
    for topic, kind, time, data in standing():
        if kind == RANGE:
            ring, sensor = data.split(b"tof_")[1][:3].decode().split("_")
            here = data.replace(b"tof_", b"abc_")
            told.append((f"/ring{ring}/range{sensor}", kind, time, here))
        else:
            told.append(
                (topic, kind, time, data.replace(b"\x06\0\0\0elbow\0", b"\x06\0\0\0bowel\0"))
            )
    told.sort(key=lambda message: message[2])
    pairs = ("tof_{ring}_{sensor}=/ring{ring}/range{sensor}", "elbow=bowel", "steps=/elsewhere")
    data = opened(mcap(tmp_path, told), pairs=pairs).gathered
    _, _, ring, sensor, distance, _ = data.rows(2)
    np.testing.assert_allclose(distance, 0.5 + 0.1 * ring + 0.01 * sensor, atol=1e-6)
    assert data.said[0][1] == {"what": "begin", "step": "self", "number": 0}


@given(
    st.lists(st.floats(0.2, 3.0).map(lambda s: round(s, 1)), min_size=1, max_size=6),
    st.floats(0, 4e-4),
    st.integers(0, 9),
)
def test_standstills_are_found_as_they_were(lengths, noise, seed):
    """Between two of them the robot moves for a second by half a radian."""
    rate, rng, edges, q = 100, np.random.default_rng(seed), [], []
    for i, seconds in enumerate(lengths):
        begin = len(q)
        q += [0.5 * i] * int(seconds * rate)
        edges.append((begin / rate, (len(q) - 1) / rate))
        q += list(np.linspace(0.5 * i, 0.5 * (i + 1), rate))
    track = np.array(q)[:, None] + rng.uniform(-noise, noise, (len(q), 7))
    found = standstills(np.arange(len(q)) / rate, track, 0.05)
    wanted = [(a, b) for a, b in edges if b - a >= 1.3]
    assert len(wanted) <= len(found) <= len(edges)
    for begin, end in wanted:
        assert any(begin < s.begin < begin + 0.8 and end - 0.5 < s.end <= end + 0.2 for s in found)


def test_a_seven_axis_arm_is_checked_by_where_it_stood(tmp_path):
    """Without a plan and without notes: the stops are the standstills. Nothing is wrong with this
    rig but that its sensors are tilted by 3° more.
    """
    panda = robot("panda")
    pose = Pose(np.array([0.0, 0.3, 0.0, -1.8, 0.0, 2.0, 0.8]))
    scene = replace(SCENE, robot=panda, poses=(pose,), goals=(Goal(Target("V_S", 0.25)),))
    setup = Setup((Ring("forearm", 0.5, 8, 0.4, 0.0, 0.09),))
    mounted = Setup((replace(setup.rings[0], tilt=0.4 + np.radians(3)),))
    world, rng, told = World(scene, mounted), np.random.default_rng(0), []
    stops = pose.q + rng.uniform(-0.7, 0.7, (12, 7))
    time = START
    for q in stops:
        distances = world.distances(q[None])[0]
        for n in range(120):
            time += 0.01
            told.append(("/joint_states", JOINTS, time, joint_state(time, panda.chain.joints, q)))
            if n % 4 == 2:
                for k, (read, status) in enumerate(zip(*world.told(rng, distances), strict=True)):
                    shown = math.inf if status == Status.NO_TARGET else float(read)
                    told.append(("/tof", RANGE, time, range_(time, f"tof_0_{k}", shown)))
        time += 1.0  # on the way nothing is recorded
    (tmp_path / "panda.toml").write_text(to_toml(ProposalFile.of(setup, scene)))
    words = ["check", str(tmp_path / "panda.toml"), "--joints", str(mcap(tmp_path, told))]
    assert call([*words, "--out", str(tmp_path / "out"), "--voxel", "0.05"]) == 0
    result = CheckResult.model_validate_json((tmp_path / "out" / "check.json").read_text())
    assert result.mount.stops == result.mount.planned == 12
    tilt = next(e for e in result.mount.rings[0].errors if e.name == "tilt")
    assert abs(tilt.value - 3) < 2 * tilt.margin < 2
    assert any("coverage check: left out" in warning for warning in result.warnings)
    with pytest.raises(
        UserError, match="--part coverage: no --plan FOLDER with its trials, wanted"
    ):
        call([*words, "--part", "coverage"])


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--joints", "a", "--rig", "sim"], "give exactly one of --rig sim, --robot-host HOST"),
        (["--joints", "a", "--move"], "--move: allowed only with --robot-host HOST; only ur-rtde"),
        (["--joints", "a", "--ring", "tool=b"], "--ring: allowed only with --robot-host HOST"),
        (["--rig", "sim", "--readings", "a"], "--readings: allowed only with --joints FILE"),
        (["--rig", "sim", "--map", "a=b"], "--map: allowed only with --joints FILE"),
        (["--plan-only", "--plan", "a"], "--plan: allowed only with --joints FILE"),
        (["--plan-only", "--part", "self"], "--plan-only: found --part self, wanted: mount or"),
        (["--joints", "a.csv"], "a.csv: cannot be read: No such file"),
        (["--joints", "a.mcap"], "a.mcap: cannot be read: No such file"),
    ],
)
def test_options_that_do_not_fit_are_one_line(tmp_path, monkeypatch, words, line):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as error:
        call(["check", "n1_8_0", *words])
    assert line in str(error.value)
    assert not list(tmp_path.iterdir())


def test_plans_are_written_for_other_programs_and_read_back(rig, tmp_path, monkeypatch, capsys):
    folder, _, _ = rig
    mount, rods = read_plans(SCENE, ("mount", "coverage"), folder)
    plans = Plans(None, mount, rods)
    monkeypatch.setattr(check, "plan_check", Mock(spec=plan_check, return_value=plans))
    words = ["check", str(folder / "small.toml"), "--plan-only", "--out", str(tmp_path / "plan")]
    assert call(words) == 0
    written = {p.name for p in (tmp_path / "plan").iterdir()}
    assert written >= {"stops.toml", "trials-V_S-0.25.toml", "trials-V_S-0.2.toml", "trials.pdf"}
    assert all(name in capsys.readouterr().out for name in ["stops.toml"])
    again, _ = read_plans(SCENE, ("mount",), tmp_path / "plan")
    np.testing.assert_array_equal(again.joints, mount.joints)
    panda = replace(SCENE, robot=robot("panda"))
    with pytest.raises(UserError, match=r"stops.toml: found poses of 6 joints, wanted: 7, as pan"):
        read_plans(panda, ("mount",), folder)
    with pytest.raises(UserError, match=r"stops.toml"):
        read_plans(SCENE, ("mount",), tmp_path)
    (tmp_path / "plan" / "trials-V_S-0.2.toml").unlink()
    again, none = read_plans(SCENE, ("mount", "coverage"), tmp_path / "plan", required=False)
    assert (len(again.joints), none) == (len(mount.joints), ())
    with pytest.raises(UserError, match=r"found no plan, wanted: stops.toml, as --plan-only"):
        read_plans(SCENE, ("mount", "coverage"), tmp_path, required=False)


@pytest.mark.slow
def test_the_simulated_rigs_live_check_and_its_files_find_the_same(tmp_path, monkeypatch):
    """On a busy machine the simulated robot's states have gaps, in which a live check of it is more
    patient than one of files. So the files may hold fewer readings.
    """
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(to_toml(ProposalFile.of(SETUP, SCENE)))
    words = ["check", "small.toml", "--voxel", "0.05", "--part", "self", "--part", "mount"]
    code = call([*words, "--rig", "sim", "--seed", "3", "--wave", "--stops", "20", "--out", "live"])
    recorded = RecordingReader(tmp_path / "live" / "recording-1.rig")
    checked = PlannedCheck.read("live", recorded.about["check"])
    gathered = replay(recorded, checked.ports, checked.about.stale_s)
    live = CheckResult.model_validate_json((tmp_path / "live" / "check.json").read_text())
    for kind in ("lz4", "sqlite", "csv"):
        files = written(tmp_path, gathered, kind)
        assert call([*words, *files, "--plan", "live", "--out", f"{kind}-out"]) == code
        file = tmp_path / f"{kind}-out" / "check.json"
        result = CheckResult.model_validate_json(file.read_text())
        assert (result.verdict, result.reasons) == (live.verdict, live.reasons)
        for ring, was in zip(result.mount.rings, live.mount.rings, strict=True):
            assert ring.faults == was.faults
            for error, one in zip(ring.errors, was.errors, strict=True):
                assert abs(error.value - one.value) <= max(error.margin, one.margin)


@given(st.floats(0.06, 2.0), st.floats(0, 0.02))
def test_in_a_gap_a_reading_counts_where_the_robot_did_not_move(tmp_path_factory, gap, moved):
    told = [m for m in standing() if not START + 0.5 < m[2] < START + 1.5 or m[1] == RANGE]
    q = np.array([0.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    for i, (topic, kind, time, _) in enumerate(told):
        if kind == JOINTS and time > START + 1.2:
            shifted = joint_state(time - 1.0 + gap, CHAIN, [*q[:2], q[2] + moved, *q[3:]])
            told[i] = (topic, kind, time - 1.0 + gap, shifted)
    told.sort(key=lambda message: message[2])
    data = opened(mcap(tmp_path_factory.mktemp("gap"), told)).gathered
    time = data.rows(2)[0] - START
    begin = max(s.time for s in data.states if s.time <= START + 0.501) - START
    end = min(s.time for s in data.states if s.time > START + 0.501) - START
    inside = np.any((time > begin + 0.001) & (time < end - 0.001))
    read = [f for _, f in data.frames if begin + 0.001 < f.time - START < end - 0.001]
    held = end - begin <= 1.0 and moved <= np.radians(0.1)
    assert inside == (bool(read) and (held or end - begin <= 0.05))
    gaps = [note for _, note in data.said if note["what"] == "warning"]
    assert bool(gaps) == (not held and end - begin > 0.0501)


@given(st.integers(0, 99), st.floats(-1e-4, 1e-4), st.floats(-1e6, 1e6))
def test_readings_count_when_they_were_measured(tmp_path_factory, seed, drift, offset):
    """By the clock of their sender, whose offset and drift are estimated: the recorder writes them
    down late, now and then very late.
    """
    rng, told = np.random.default_rng(seed), [m for m in standing(6.0) if m[1] == JOINTS]
    true = 0.1 + np.arange(100) * 0.05
    late = rng.exponential(0.004, 100) + 0.03 * (rng.random(100) < 0.1)
    arrival = np.maximum.accumulate(true + late)
    for t, at in zip(true, arrival, strict=True):
        for ring, sensor in SETUP.labels:
            stamp = START + offset + (1 + drift) * t
            data = range_(stamp, f"tof_{ring}_{sensor}", 0.5)
            told.append(("/tof", RANGE, START + at, data))
    told.sort(key=lambda message: message[2])
    data = opened(mcap(tmp_path_factory.mktemp("late"), told)).gathered
    time, _, ring, sensor, _, _ = data.rows(2)
    one = np.sort(time[(ring == 0) & (sensor == 0)]) - START
    assert np.abs(one - true).max() < 0.004
    assert data.clocks(2)[0].jitter < 0.05
