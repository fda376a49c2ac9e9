"""The log of a check: other programs read it, and a check from it alone finds the same."""

import math
import struct
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from place_rings.cli.app import app
from place_rings.coverage.rings.ring import Ring
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.errors import UserError
from place_rings.formats.export.ros2_bag import POINTS, RosBag
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.sensors.sensor_frames import looking_along, sensor_frames
from place_rings.formats.writing import to_toml
from place_rings.rig.check.bag_log import write_bag, zone_points
from place_rings.rig.check.models import CheckResult
from place_rings.rig.check.plans import write_plans
from place_rings.rig.recording.recording import RecordingReader
from place_rings.rig.rings.protocol import Frame, Status
from place_rings.rig.rings.zones import Zones
from place_rings.rig.sensing.zone_grid import TURNS_DEG
from place_rings.rig.session.gathering import Gathered, replay
from place_rings.rig.sources.ring_track import RingTrack
from place_rings.rig.sources.ros_messages import DECODERS
from scipy.spatial.transform import Rotation

from .cell import SETUP
from .tape import record
from .test_check import SCENE, about
from .test_files import call, findings, unlike


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A whole check of a simulated rig and its data."""
    folder = tmp_path_factory.mktemp("rig")
    tape, checked = record(folder / "tape.rig", about())
    (folder / "small.toml").write_text(to_toml(ProposalFile.of(SETUP, SCENE)))
    write_plans(SCENE, checked.plans, folder)
    recorded = RecordingReader(tape)
    gathered = replay(recorded, checked.ports, checked.about.stale_s)
    return folder, checked, gathered, recorded


class Cdr:
    """Reads numbers and texts of CDR one after another: each number at a multiple of its size."""

    def __init__(self, data):
        assert data[:4] == b"\0\1\0\0"
        self.data, self.at = data[4:], 0

    def take(self, kind, count=1):
        values = []
        for _ in range(count):
            size = struct.calcsize(kind)
            self.at += -self.at % size
            values += struct.unpack_from("<" + kind, self.data, self.at)
            self.at += size
        return values[0] if count == 1 else values

    def text(self):
        size = self.take("I")
        self.at += size
        return self.data[self.at - size : self.at - 1].decode()

    def header(self):
        return self.take("i") + 1e-9 * self.take("I"), self.text()


def messages(folder):
    """Topic, type, time of reception in s, and data of all messages, by the format's library."""
    (file,) = folder.glob("*.mcap")
    with file.open("rb") as stream:
        return [
            (channel.topic, schema.name, message.log_time / 1e9, message.data)
            for schema, channel, message in make_reader(stream).iter_messages()
        ]


@pytest.fixture(scope="module")
def bag(rig, tmp_path_factory):
    _, checked, gathered, recorded = rig
    folder = tmp_path_factory.mktemp("bag")
    names = write_bag(checked, gathered, recorded.epoch, folder)
    assert names == ["bag-1/bag-1.mcap", "bag-1/metadata.yaml"]
    return folder / "bag-1"


def test_every_state_and_reading_is_in_the_log(rig, bag):
    _, _, gathered, recorded = rig
    every, epoch = messages(bag), recorded.epoch
    assert epoch == pytest.approx(time.time() - time.monotonic(), abs=0.5)
    assert [m[2] for m in every] == sorted(m[2] for m in every)
    states = [(t, Cdr(data)) for topic, _, t, data in every if topic == "/joint_states"]
    assert len(states) == len(gathered.states)
    for (received, cdr), state in zip(states, gathered.states, strict=True):
        stamp, _ = cdr.header()
        names = [cdr.text() for _ in range(cdr.take("I"))]
        assert names == list(SCENE.robot.chain.joints)
        assert cdr.take("d", cdr.take("I")) == state.q.tolist()
        assert received - state.time == pytest.approx(epoch, abs=1e-6)
        assert stamp == pytest.approx(received, abs=1e-6)
    told = {}
    for ring, frame in gathered.frames:
        for k, (distance, status) in enumerate(zip(frame.distance, frame.status, strict=True)):
            value = {0: float(distance), 1: math.inf}.get(int(status), math.nan)
            told.setdefault(f"/tof_{ring}_{k}", []).append(value)
    read = {}
    for topic, kind, received, data in every:
        if kind == "sensor_msgs/msg/Range":
            cdr = Cdr(data)
            stamp, frame = cdr.header()
            assert (f"/{frame}", cdr.take("B")) == (topic, 1)
            angle, low, high, value = cdr.take("f", 4)
            assert angle == pytest.approx(np.radians(25))
            assert not low <= value <= high or math.isfinite(value)
            assert abs(stamp - received) < 0.1
            read.setdefault(topic, []).append(value)
    assert read.keys() == told.keys()
    for topic, values in told.items():
        np.testing.assert_allclose(read[topic], np.float32(values), rtol=1e-6)


def test_the_transforms_alone_place_every_sensor(rig, bag):
    _, checked, gathered, _ = rig
    frames, last = {}, {}
    for _, kind, _, data in messages(bag):
        if kind != "tf2_msgs/msg/TFMessage":
            continue
        cdr = Cdr(data)
        for _ in range(cdr.take("I")):
            _, parent = cdr.header()
            child, values = cdr.text(), cdr.take("d", 7)
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = Rotation.from_quat(values[3:]).as_matrix(), values[:3]
            last[child] = (parent, T)

    def placed(name):
        if name not in frames:
            parent, T = last[name] if name in last else (None, np.eye(4))
            frames[name] = T if parent is None else placed(parent) @ T
        return frames[name]

    own = forward(SCENE.robot.chain, gathered.states[-1].q)
    for sensor in sensor_frames(SCENE.robot, checked.setup):
        T = own[sensor.frame] @ looking_along(sensor.T_frame_sensor, "x")
        np.testing.assert_allclose(placed(sensor.name), T, atol=1e-6)


def test_warnings_and_faults_are_in_the_log(rig, tmp_path):
    _, checked, gathered, recorded = rig
    said = [*gathered.said, (101.0, {"what": "warning", "text": "the lamp is on"})]
    more = Gathered(gathered.states, gathered.frames, gathered.events, said=said)
    write_bag(checked, more, recorded.epoch, tmp_path)
    lines = []
    for topic, _, _, data in messages(tmp_path / "bag-1"):
        if topic == "/rosout":
            cdr = Cdr(data)
            cdr.take("i"), cdr.take("I")
            lines.append((cdr.take("B"), cdr.text(), cdr.text()))
    assert (30, "check", "the lamp is on") in lines


@pytest.mark.long
def test_a_check_from_its_own_log_finds_the_same(rig, tmp_path, capsys):
    folder, *_ = rig
    out = tmp_path / "replayed"
    words = ["check", "--replay", str(folder / "tape.rig"), "--out", str(out), "--bag"]
    assert call(words) == 1
    assert "bag-1.mcap" in capsys.readouterr().err
    words = ["check", str(folder / "small.toml"), "--plan", str(folder), "--voxel", "0.05"]
    again = tmp_path / "again"
    assert call([*words, "--joints", str(out / "bag-1"), "--out", str(again)]) == 1
    live, read = (
        CheckResult.model_validate_json((f / "check.json").read_text()) for f in (out, again)
    )
    assert unlike(findings(read), findings(live)) == []
    assert [line.frames for line in read.lines] == [line.frames for line in live.lines]


def test_a_log_that_cannot_be_written_leaves_nothing(rig, tmp_path, monkeypatch):
    _, checked, gathered, recorded = rig

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(RosBag, "write", full)
        with pytest.raises(UserError, match="bag-1: the bag cannot be written: No space left"):
            write_bag(checked, gathered, recorded.epoch, tmp_path)
    for start in (-1e6, 3e9):  # stamps have 31 bits
        with pytest.raises(UserError, match="wanted: 0 to 2147483648 for a bag"):
            write_bag(checked, gathered, start, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_log_never_replaces_another(rig, tmp_path):
    _, checked, gathered, recorded = rig
    few = Gathered(gathered.states[:3])
    for i in (1, 2):
        assert write_bag(checked, few, recorded.epoch, tmp_path)[0] == f"bag-{i}/bag-{i}.mcap"
        about_it = yaml.safe_load((tmp_path / f"bag-{i}" / "metadata.yaml").read_text())
        # three states within 0.05 s: one transform, and the fixed ones
        assert about_it["rosbag2_bagfile_information"]["message_count"] == 3 + 1 + 1


@given(st.sampled_from(TURNS_DEG), st.booleans(), st.integers(0, 7), st.integers(0, 7))
def test_a_zone_is_where_its_sensor_looks(turn, mirrored, row, column):
    """One zone sees something: as meant, the upper rows are above the axis, the left columns left
    of it, and neighbours are a pixel apart."""
    sensor = Sensor(np.radians(22.5), 1.5, None, np.radians(30), zones=8)
    ring = Ring("tool", 0.0, 1, 0.0, 0.0, 0.08, sensor, zone_turn_deg=turn, zone_mirrored=mirrored)
    grid = np.full((8, 8), np.nan)
    grid[row, column] = 1.25
    arrived = np.rot90(grid, -turn // 90)
    arrived = arrived[:, ::-1] if mirrored else arrived
    status = np.where(np.isnan(arrived), Status.NO_TARGET, Status.VALID)
    zones = Zones.of(np.nan_to_num(arrived)[None, ..., None], status[None, ..., None])
    frame = Frame(0.0, 0.0, 0, np.array([1.25]), np.array([0]), zones=zones)
    points = zone_points(frame, 0, ring)
    (seen,) = np.argwhere(np.isfinite(points[..., 0]))
    assert np.isfinite(arrived[tuple(seen)])
    x, y, z = points[tuple(seen)]
    assert math.hypot(x, y, z) == pytest.approx(1.25, abs=1e-6)
    side, up = math.tan(sensor.half_angle), math.tan(sensor.half_angle_up)
    assert y / x == pytest.approx(side * (7 - 2 * column) / 8, abs=1e-6)
    assert z / x == pytest.approx(up * (7 - 2 * row) / 8, abs=1e-6)


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([(4, 4), (8, 8)]),
    st.sampled_from([None, Status.FAILED, Status.WEAK, Status.NO_TARGET]),
)
def test_zones_come_back_from_a_bag_with_their_states(seed, shape, all_alike):
    """Valid, empty, weak and failed zones; where all failed, so did the sensor."""
    rng = np.random.default_rng(seed)
    status = rng.integers(0, 4, shape)
    if all_alike is not None:
        status[...] = all_alike
    way = rng.normal(size=(*shape, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    far = np.where(status == Status.VALID, rng.uniform(0.05, 3.9, shape), np.nan)
    with tempfile.TemporaryDirectory() as folder:
        with RosBag(Path(folder) / "bag") as bag:
            cloud = bag.points(1.0, "tof_0_0", far[..., None] * way, status)
            bag.write("/tof_0_0/zones", POINTS, 1.0, cloud)
        ((topic, kind, time, data),) = messages(Path(folder) / "bag")
    read = DECODERS[kind](topic, time, data)
    np.testing.assert_allclose(read.zones, far, rtol=1e-6)
    np.testing.assert_array_equal(read.zone_status, status)
    if np.isnan(far).all():
        if (status == Status.WEAK).any():
            assert read.status == Status.WEAK
        else:
            failed = (status == Status.FAILED).all()
            assert read.status == (Status.FAILED if failed else Status.NO_TARGET)
    else:
        assert read.status == Status.VALID
        assert read.distance == pytest.approx(np.nanmin(far), rel=1e-6)
    track = RingTrack(0, 1)
    track.take("a bag", 0, read)
    track.close("a bag")
    (frame,) = track.frames
    np.testing.assert_array_equal(frame.zones.status[0, ..., 0], status)
    np.testing.assert_array_equal(frame.zones.mm[0, ..., 0], np.rint(1000 * np.nan_to_num(far)))


@pytest.mark.parametrize("way", ["--dry-run", "--plan-only", "--joints rig.mcap"])
def test_a_log_needs_data_of_its_own(way, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = "--bag: allowed only with --rig sim, --robot-host HOST or --replay FILE"
    with pytest.raises(UserError, match=line):
        app(["check", "n2_16_25", *way.split(), "--bag"], result_action="return_value")
    assert list(tmp_path.iterdir()) == []
