"""The log of a check: other programs read it."""

import math
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from place_rings.coverage.rings.ring import Ring
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.export.ros2_bag import POINTS, RosBag
from place_rings.formats.sensors.sensor_frames import looking_along, sensor_frames
from place_rings.rig.check.bag_log import write_bag
from place_rings.rig.rings.protocol import Status
from place_rings.rig.session.gathering import Gathered
from place_rings.rig.sources.ring_track import RingTrack
from place_rings.rig.sources.ros_messages import DECODERS
from place_rings.simulation.twin.ros_topics import zone_points
from place_rings.simulation.twin.zone_grid import TURNS_DEG
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from ..support.refusals import refused
from .cell import SCENE

STORE = get_typestore(Stores.ROS2_HUMBLE)


def stored(folder):
    """Topic, type, time of reception in s, and data of all messages, by the format's library."""
    (file,) = folder.glob("*.mcap")
    with file.open("rb") as stream:
        return [
            (channel.topic, schema.name, message.log_time / 1e9, message.data)
            for schema, channel, message in make_reader(stream).iter_messages()
        ]


def messages(folder, kind):
    """Topic, time of reception in s, and each message of a kind."""
    all_ = stored(folder)
    return [(topic, t, STORE.deserialize_cdr(m, k)) for topic, k, t, m in all_ if k == kind]


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


@pytest.fixture(scope="module")
def bag(taped, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag")
    names = write_bag(taped.checked, taped.gathered, taped.recorded.epoch, folder)
    assert names == ["bag-1/bag-1.mcap", "bag-1/metadata.yaml"]
    return folder / "bag-1"


def test_every_state_and_reading_is_in_the_log(taped, bag):
    gathered, epoch, times = taped.gathered, taped.recorded.epoch, [m[2] for m in stored(bag)]
    assert epoch == pytest.approx(time.time() - time.monotonic(), abs=0.5)
    assert times == sorted(times)
    states = messages(bag, "sensor_msgs/msg/JointState")
    for (topic, received, told), state in zip(states, gathered.states, strict=True):
        assert (topic, told.name) == ("/joint_states", [*SCENE.robot.chain.joints])
        assert told.position.tolist() == state.q.tolist()
        assert received - state.time == pytest.approx(epoch, abs=1e-6)
        assert stamp(told) == pytest.approx(received, abs=1e-6)
    told = {}
    for ring, frame in gathered.frames:
        for k, (distance, status) in enumerate(zip(frame.distance, frame.status, strict=True)):
            value = {0: float(distance), 1: math.inf}.get(int(status), math.nan)
            told.setdefault(f"/tof_{ring}_{k}", []).append(value)
    read = {}
    for topic, received, one in messages(bag, "sensor_msgs/msg/Range"):
        assert (f"/{one.header.frame_id}", one.radiation_type) == (topic, 1)
        assert one.field_of_view == pytest.approx(np.radians(25))
        assert not one.min_range <= one.range <= one.max_range or math.isfinite(one.range)
        assert abs(stamp(one) - received) < 0.1
        read.setdefault(topic, []).append(one.range)
    assert read.keys() == told.keys()
    for topic, values in told.items():
        np.testing.assert_allclose(read[topic], np.float32(values), rtol=1e-6)


def test_the_transforms_alone_place_every_sensor(taped, bag):
    frames, last = {}, {}
    for _, _, told in messages(bag, "tf2_msgs/msg/TFMessage"):
        for one in told.transforms:
            T, at, turn = np.eye(4), one.transform.translation, one.transform.rotation
            T[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
            T[:3, 3] = at.x, at.y, at.z
            last[one.child_frame_id] = (one.header.frame_id, T)

    def placed(name):
        if name not in frames:
            parent, T = last[name] if name in last else (None, np.eye(4))
            frames[name] = T if parent is None else placed(parent) @ T
        return frames[name]

    own = forward(SCENE.robot.chain, taped.gathered.states[-1].q)
    for sensor in sensor_frames(SCENE.robot, taped.checked.setup):
        T = own[sensor.frame] @ looking_along(sensor.T_frame_sensor, "x")
        np.testing.assert_allclose(placed(sensor.name), T, atol=1e-6)


def test_warnings_and_faults_are_in_the_log(taped, tmp_path):
    said = [(101.0, {"what": "warning", "text": "the lamp is on"})]
    few = Gathered(taped.gathered.states[:3], said=said)
    write_bag(taped.checked, few, taped.recorded.epoch, tmp_path)
    ((_, _, line),) = messages(tmp_path / "bag-1", "rcl_interfaces/msg/Log")
    assert (line.level, line.name, line.msg) == (30, "check", "the lamp is on")


def test_a_log_that_cannot_be_written_leaves_nothing_and_none_replaces_another(
    taped, tmp_path, monkeypatch
):
    checked, epoch, few = taped.checked, taped.recorded.epoch, Gathered(taped.gathered.states[:3])

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(RosBag, "write", full)
        with refused("bag-1", "No space left on device"):
            write_bag(checked, few, epoch, tmp_path)
    for start in (-1e6, 3e9):  # stamps have 31 bits
        with refused("2147483648"):
            write_bag(checked, few, start, tmp_path)
    assert list(tmp_path.iterdir()) == []
    for i in (1, 2):
        assert write_bag(checked, few, epoch, tmp_path)[0] == f"bag-{i}/bag-{i}.mcap"
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
    points = zone_points(np.nan_to_num(arrived), status, ring)
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
        ((topic, kind, time, data),) = stored(Path(folder) / "bag")
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
