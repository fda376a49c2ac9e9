"""A check from files alone: MCAP, bags of SQLite and CSV give the findings of the rig itself, and
whatever else a file holds is refused.
"""

import math
import sqlite3
import tracemalloc
from dataclasses import replace
from unittest.mock import Mock

import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType
from place_rings.cli.runs import check, check_summary
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import robot
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.rig.check.assessment import assess
from place_rings.rig.check.bag_log import write_bag
from place_rings.rig.check.offline import file_check
from place_rings.rig.check.options import CheckOptions, FileOptions
from place_rings.rig.check.planned_check import ring_names
from place_rings.rig.check.plans import Plans, plan_check, read_plans
from place_rings.rig.check.procedure import skipped
from place_rings.rig.rings.protocol import ABSENT, Status
from place_rings.rig.simulated_cell.world import World
from place_rings.rig.sources import bags
from place_rings.rig.sources.files import RigFiles, read_files
from place_rings.rig.sources.names import STEPS, rig_names
from place_rings.rig.sources.standstills import standstills
from rosbags.rosbag2 import ReaderError, storage_mcap

from ..support.refusals import refused
from .bags import (
    JOINTS,
    POINTS,
    RANGE,
    START,
    TEXT,
    joint_state,
    range_,
    recorded_messages,
    rig_messages,
    text,
    write_mcap,
    write_sqlite,
    write_tables,
    zones,
)
from .cell import SETUP
from .cell import SHELLS as SCENE
from .commands import call, proposed, result_of
from .tape import rows

ROBOT = SCENE.robot
CHAIN = ROBOT.chain.joints


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


def written(folder, taped, kind):
    """Write the data of a rig as files, or as the log of its check; return their paths by name."""
    if kind == "csv":
        write_tables(folder / kind, taped.gathered, CHAIN)
        return {name: folder / kind / f"{name}.csv" for name in ("joints", "readings", "steps")}
    messages, file = recorded_messages(taped.gathered, CHAIN), folder / f"rig.{kind}"
    if kind == "bag":
        file = folder / write_bag(taped.checked, taped.gathered, taped.recorded.epoch, folder)[0]
    elif kind == "db3":
        write_sqlite(file, messages)
    else:
        write_mcap(file, messages)
    return {"joints": file}


def test_files_of_an_earlier_check_are_named(taped, tmp_path, capsys):
    done = Mock(result=taped.found.result)
    for name, files, named in (
        ("none", ["check.html"], False),
        ("built.toml", ["check.html"], True),
        ("built.toml", ["check.html", "built.toml"], False),
    ):
        (tmp_path / name).write_text("")
        check_summary.tell(done, files, tmp_path, False)
        assert ("earlier check: built.toml" in capsys.readouterr().out) == named


@pytest.mark.parametrize("kind", ["mcap", "db3", "csv", "bag"])
def test_files_of_each_kind_hold_all_readings(taped, tmp_path, kind):
    live, paths = taped.gathered, written(tmp_path, taped, kind)
    data = opened(paths.pop("joints"), **paths).gathered
    assert [s.q.tolist() for s in data.states] == [s.q.tolist() for s in live.states]
    for read, was in zip(rows(data)[1:], rows(live)[1:], strict=True):
        np.testing.assert_allclose(read, was, atol=1e-6)
    steps, wanted = (
        [(note["step"], note["number"]) for _, note in said if note["what"] == "begin"]
        for said in (data.said, live.said)
    )
    assert steps == wanted


@pytest.mark.parametrize("kind", [pytest.param("csv", marks=pytest.mark.slow), "bag"])
def test_a_check_from_files_alone_finds_what_the_live_check_found(taped, tmp_path, kind):
    live, out = taped.found.result, tmp_path / "out"
    words = ["check", taped.folder / "small.toml", "--plan", taped.folder, "--voxel", "0.1"]
    words += [
        word for name, at in written(tmp_path, taped, kind).items() for word in (f"--{name}", at)
    ]
    assert call(*words, "--out", out) == 1
    result = result_of(out)
    assert not result.simulated
    assert unlike(findings(result), findings(live)) == []
    assert [line.frames for line in result.lines] == [line.frames for line in live.lines]
    if kind != "csv":  # which has no clock of the sender
        for line, was in zip(result.lines, live.lines, strict=True):
            assert line.drift_ppm == pytest.approx(was.drift_ppm, abs=0.5)
        assert result.robot.drift_ppm == pytest.approx(live.robot.drift_ppm, abs=0.5)
    # between its steps this rig told nothing
    sources = {"joint states", "ring 0 (forearm)", "ring 1 (tool)"}
    assert {w.split(":")[0] for w in result.warnings} == sources
    assert {p.name for p in out.iterdir()} >= {"check.html", "built.toml"}


def from_tables(folder, gathered, scene=SCENE, plan=None, parts=("mount",)):
    """A check from the tables that a rig wrote."""
    write_tables(folder, gathered, CHAIN)
    paths = (folder / f"{name}.csv" for name in ("joints", "readings", "steps"))
    files = FileOptions(*paths, plan=plan)
    return file_check("small", SETUP, scene, files, CheckOptions(part=parts, voxel=0.1))


def test_a_stop_that_the_files_lack_has_a_reason(taped, tmp_path):
    """Nothing ended the check before it, as a live check without the stop would say."""
    notes, gathered = list(taped.gathered.said), taped.gathered
    at = next(
        i
        for i, (_, note) in enumerate(notes)
        if (note["what"], note.get("step"), note.get("number")) == ("begin", "mount", 1)
    )
    without = replace(gathered, said=[*notes[:at], *notes[at + 2 :]])
    done = from_tables(tmp_path / "one", without, plan=taped.folder)
    assert skipped(done.gathered.said, "mount").keys() == {1}
    said = [note for note in notes if note[1]["what"] not in ("begin", "end")]
    done = from_tables(tmp_path / "all", replace(gathered, said=said), plan=taped.folder)
    assert len(set(skipped(done.gathered.said, "mount").values())) <= 1


def test_a_mount_check_in_an_unknown_cell_says_so(taped, tmp_path):
    """A live check refuses to start; files may hold other parts that can be assessed."""
    bare = replace(SCENE, obstacles=())
    done = from_tables(tmp_path / "csv", taped.gathered, bare, parts=("self", "mount"))
    result = assess(done).result
    assert result.verdict == "unfinished"
    assert any("mount check" in why and "obstacles" in why for why in result.reasons)


def opened(path, robot=ROBOT, setup=SETUP, readings=None, steps=None, pairs=()):
    """Read files as a check does."""
    rings = ring_names(setup)
    names = rig_names(setup, robot, rings, pairs)
    files = RigFiles.of(robot, names.steps, path, readings, steps)
    return read_files(files, setup, robot, names, rings)


def standing(seconds=2.0, q=(0.1, -0.2, 0.3, -0.4, 0.5, -0.6)):
    """A rig that stands still, each sensor at its own distance, as messages."""
    return rig_messages(np.tile(q, (int(50 * seconds), 1)), CHAIN, SETUP)


def mcap(folder, messages, **more):
    path = folder / "rig.mcap"
    write_mcap(path, messages, **more)
    return path


def refuse(folder, messages, *parts):
    """A file of such messages is refused, with its name or the option."""
    path = mcap(folder, messages)
    with refused(*parts) as error:
        opened(path)
    assert str(error.value).startswith(("--map", str(folder)))


@pytest.mark.parametrize("compression", CompressionType)
def test_a_file_is_read_as_it_was_written(tmp_path, compression):
    data = opened(mcap(tmp_path, standing(), compression=compression)).gathered
    assert len(data.states) == 100
    np.testing.assert_allclose(data.states[0].q, [0.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    assert [ring for ring, _ in data.frames].count(0) == 20
    time, joints, ring, sensor, distance, status = rows(data)
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
    read = gathered.readings()
    distance, status = read.zone_distance, read.zone_status
    assert ((status != ABSENT).sum(axis=1) == 16).sum() == 1
    assert np.isfinite(distance).sum() == 15


def changed(kind, data, at=1.0):
    """The messages of a rig with one more of a kind."""
    topic = {JOINTS: "/joint_states", RANGE: "/tof", POINTS: "/zones", TEXT: STEPS}[kind]
    return sorted([*standing(), (topic, kind, START + at, data)], key=lambda m: m[2])


def cloud(before, after):
    """A cloud of one point, damaged."""
    data = zones(0.0, "tof_1_0", [(1.0, 0.0, 0.0)])
    assert data.count(before) == 1
    return data.replace(before, after)


ROWS = b"\1\0\0\0" * 2
BROKEN = b"\0\1\0\0" + b"\xff" * 12


@pytest.mark.parametrize(
    ("kind", "data", "parts"),
    [
        (JOINTS, joint_state(0, CHAIN, [0.0] * 5), ("6 names", "5 positions")),
        (JOINTS, joint_state(0, CHAIN[:4], [0.0] * 4), ("wrist_2, wrist_3", "--map")),
        (JOINTS, joint_state(0, (*CHAIN, "elbow_joint"), [0.0] * 7), ("twice",)),
        (JOINTS, BROKEN, ("16 bytes", "sensor_msgs/msg/JointState")),
        (RANGE, BROKEN, ('"/tof', "16 bytes")),
        (POINTS, BROKEN, ("16 bytes",)),
        (TEXT, text("dance 3"), ("dance 3", "self, wave N")),
        (TEXT, text("mount"), ("mount", "wave N")),
        (TEXT, BROKEN, ("16 bytes",)),
        (TEXT, zstandard.compress(text("self")), ("CDR", "decompress")),
        (POINTS, cloud(b"x\0", b"a\0"), ("a, intensity, y, z", "x, y and z")),
        (POINTS, cloud(ROWS + b"\4", b"\x39\x30\0\0\1\0\0\0\4"), ("12345 points",)),
        (POINTS, cloud(ROWS + b"\4", b"\2\0\0\0\1\0\0\0\4"), ("2 rows of 16",)),
    ],
)
def test_a_message_that_cannot_be_is_refused(tmp_path, kind, data, parts):
    refuse(tmp_path, changed(kind, data), *parts)


def test_what_a_file_lacks_is_named(tmp_path):
    told = standing()
    named = [(*m[:3], joint_state(m[2], ["a", "b"], [0, 0])) if m[1] == JOINTS else m for m in told]
    other = [(*m[:3], m[3].replace(b"tof_1_", b"abc_1_")) for m in told]
    late = [(*m[:2], m[2] + 60 * (m[1] == RANGE), m[3]) for m in told]
    slow = [m for m in told if m[1] != JOINTS or round(50 * (m[2] - START)) % 40 == 0]
    twice = [("/b", *m[1:]) if b"tof_0_3" in m[3] and m[2] > START + 1 else m for m in told]
    for messages, parts in (
        ([m for m in told if m[1] != JOINTS], ("joint states", "0 states of ur10")),
        (named, ("a, b", "shoulder_pan")),
        ([m for m in told if m[1] == JOINTS], ("ring forearm", "none")),
        (late, ("between",)),
        (slow, ("0.8 s", "0.5 s")),
        ([("/chatter", TEXT, START, text("hello"))], ('"/chatter"',)),
        (twice, ("tof_0_3", '"/tof"', '"/b"')),
        (other, ("ring tool", '"abc_1_0"', "--map")),
    ):
        refuse(tmp_path, messages, *parts)
    assert opened(tmp_path / "rig.mcap", pairs=("tool=abc_1_{sensor}",)).gathered.frames


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
    with refused("/joint_states", "1.98 s"):
        opened(tmp_path)
    for file in tmp_path.glob("*.mcap"):
        file.rename(f"{file}.zstd")
    with refused("0 files", "zstd -d"):
        opened(tmp_path)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A small MCAP file and a small database."""
    folder = tmp_path_factory.mktemp("small")
    write_mcap(folder / "a.mcap", standing(0.3), chunk_size=2000)
    write_sqlite(folder / "bag", standing(0.3))
    return {".mcap": folder / "a.mcap", ".db3": folder / "bag" / "bag_0.db3"}


@given(st.sampled_from([".mcap", ".db3"]), st.floats(0, 1), st.integers(1, 255), st.booleans())
def test_a_damaged_file_is_read_or_refused(small, tmp_path_factory, kind, at, by, cut):
    data = bytearray(small[kind].read_bytes())
    place = int(at * (len(data) - 1))
    data[place] ^= by
    path = tmp_path_factory.mktemp("bad") / f"a{kind}"
    path.write_bytes(data[:place] if cut else data)
    line = ""
    try:
        assert opened(path).gathered.states
    except UserError as error:
        line = str(error)
    assert line.startswith(str(path)) if line else not cut
    assert "\n" not in line


@pytest.mark.parametrize("data", ["'text'", "9000000000000000000", "1.5", "x'00'"])
def test_a_database_of_other_values_is_refused(tmp_path, data):
    write_sqlite(tmp_path / "bag", standing(0.2))
    with sqlite3.connect(tmp_path / "bag" / "bag_0.db3") as database:
        database.execute(f"UPDATE messages SET data = {data} WHERE id = 20")
    database.close()
    with refused("bag_0.db3"):
        opened(tmp_path / "bag")


@given(st.sampled_from([".mcap", ".db3"]), st.binary(max_size=200))
def test_any_bytes_are_refused(tmp_path_factory, kind, data):
    path = tmp_path_factory.mktemp("any") / f"a{kind}"
    path.write_bytes(data)
    with refused(path):
        opened(path)


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_file_that_unpacks_to_much_more_than_it_says_is_refused(tmp_path, compression):
    path = mcap(tmp_path, standing(0.2), compression=CompressionType[compression.upper()])
    pack = {"lz4": lz4.frame.compress, "zstd": zstandard.compress}[compression]
    bomb = pack(bytes(50_000_000))
    tracemalloc.start()
    bags._limit_chunks()
    unpack = storage_mcap.DECOMPRESSORS[compression]
    assert len(unpack(bomb, 1000)) == 1001
    with refused(str(1 << 30), error=ValueError):
        unpack(bomb, 1 << 30)
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()
    assert opened(path).gathered.states
    assert storage_mcap.decompress(pack(b"abc"), compression, 3, 0) == b"abc"
    with refused(error=ReaderError):
        storage_mcap.decompress(bomb, compression, 1000, 0)


@pytest.mark.parametrize(
    ("table", "parts"),
    [
        ("", ("line 1", "t, time, time_s, timestamp")),
        ("time,range_m\n", ("time, range_m",)),
        ("time,sensor,range_m\n1,tof_0_0\n", ("line 2", "2 columns", "3")),
        ("time,sensor,range_m\nx,tof_0_0,1\n", ("line 2", "column time", '"x"')),
        ("time,sensor,range_m\nnan,tof_0_0,1\n", ("column time", "nan")),
        ("time,sensor,range_m\n1,tof_0_0,far\n", ("column range_m", '"far"')),
        ("time,sensor,range_m\n1,tof_0_0,612\n", ("612.0", "65.535")),
        ("time,sensor,range_m\n2,tof_0_0,1\n1,tof_0_1,1\n", ("1 s before",)),
        ("time,sensor,range_m\n" + "1" * 9999, ("line 2", "4096")),
        ("time,sensor,range_m\n1,tof_0_0,1\n", ("ring tool",)),
    ],
)
def test_a_table_that_cannot_be_is_refused(tmp_path, table, parts):
    joints, readings = tmp_path / "joints.csv", tmp_path / "readings.csv"
    lines = [",".join(["time", *CHAIN]), *(f"{n / 10},0,0,0,0,0,0" for n in range(1, 40))]
    joints.write_text("\n".join(lines))
    readings.write_text(table)
    with refused(*parts) as error:
        opened(joints, readings=readings)
    assert str(error.value).startswith(str(readings))


def test_a_time_out_of_order_is_named_in_full(tmp_path):
    lines = [",".join(["time", *CHAIN]), *(f"{START + t},0,0,0,0,0,0" for t in (0.5, 0.25))]
    (tmp_path / "joints.csv").write_text("\n".join(lines))
    with refused("joints.csv", "1760000000.5"):
        opened(tmp_path / "joints.csv", readings=tmp_path / "joints.csv")


@pytest.mark.parametrize(
    ("pair", "parts"),
    [
        ("tof_0_3", ("NAME=SOURCE",)),
        ("hand=x", ("hand", "shoulder_pan, ")),
        ("forearm=x", ("forearm", "{sensor}")),
        ("tof_{ring}_{sensor}=x{sensor}", ("{sensor}",)),
        ("tof_0_3=tof_0_4", ("two sensors",)),
    ],
)
def test_a_map_that_cannot_be_is_refused(pair, parts):
    with refused("--map: ", *parts):
        rig_names(SETUP, ROBOT, ring_names(SETUP), [pair])


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
    _, _, ring, sensor, distance, _ = rows(data)
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
    scene = replace(SCENE, robot=panda, poses=(pose,), targets=(Shell(0.25),))
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
    words = ["check", proposed(tmp_path, setup, scene), "--joints", mcap(tmp_path, told)]
    assert call(*words, "--out", tmp_path / "out", "--voxel", "0.1") == 0
    result = result_of(tmp_path / "out")
    assert result.mount.stops == result.mount.planned == 12
    tilt = next(e for e in result.mount.rings[0].errors if e.name == "tilt")
    assert abs(tilt.value - 3) < 2 * tilt.margin < 2
    assert any("coverage check" in warning for warning in result.warnings)
    with refused("--part coverage", "--plan"):
        call(*words, "--part", "coverage")


def test_plans_are_written_for_other_programs_and_read_back(taped, tmp_path, monkeypatch, capsys):
    folder, out = taped.folder, tmp_path / "plan"
    mount, rods = read_plans(SCENE, ("mount", "coverage"), folder)
    plans = Plans(None, mount, rods)
    monkeypatch.setattr(check, "plan_check", Mock(spec=plan_check, return_value=plans))
    assert call("check", folder / "small.toml", "--plan-only", "--out", out) == 0
    written = {p.name for p in out.iterdir()}
    assert written >= {"stops.toml", "trials-V_S-0.25.toml", "trials-V_S-0.2.toml", "trials.pdf"}
    assert "stops.toml" in capsys.readouterr().out
    again, _ = read_plans(SCENE, ("mount",), out)
    np.testing.assert_array_equal(again.joints, mount.joints)
    with refused("stops.toml", "6", "7", "panda"):
        read_plans(Scene(robot="panda"), ("mount",), folder)
    for more in ({}, {"required": False}):
        with refused(tmp_path, "stops.toml"):
            read_plans(SCENE, ("mount",), tmp_path, **more)
    (out / "trials-V_S-0.2.toml").unlink()
    again, none = read_plans(SCENE, ("mount", "coverage"), out, required=False)
    assert (len(again.joints), none) == (len(mount.joints), ())


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
    time = rows(data)[0] - START
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
    rng, told = np.random.default_rng(seed), [m for m in standing(4.0) if m[1] == JOINTS]
    true = 0.1 + np.arange(60) * 0.05
    late = rng.exponential(0.004, 60) + 0.03 * (rng.random(60) < 0.1)
    arrival = np.maximum.accumulate(true + late)
    for t, at in zip(true, arrival, strict=True):
        for ring, sensor in ((0, 0), (1, 0)):
            stamp = START + offset + (1 + drift) * t
            data = range_(stamp, f"tof_{ring}_{sensor}", 0.5)
            told.append(("/tof", RANGE, START + at, data))
    told.sort(key=lambda message: message[2])
    data = opened(mcap(tmp_path_factory.mktemp("late"), told)).gathered
    time, _, ring, sensor, _, _ = rows(data)
    one = np.sort(time[(ring == 0) & (sensor == 0)]) - START
    assert np.abs(one - true).max() < 0.004
    assert data.clocks(2)[0].jitter < 0.05
