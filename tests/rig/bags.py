"""Writers of a rig's files for tests: MCAP by the library of its authors, bags of SQLite by the
tables that rosbag2 documents, CSV as text. Messages are packed in CDR by rosbags.
"""

import math
import sqlite3
import struct

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

JOINTS = "sensor_msgs/msg/JointState"
RANGE = "sensor_msgs/msg/Range"
POINTS = "sensor_msgs/msg/PointCloud2"
TEXT = "std_msgs/msg/String"
START = 1_760_000_000.0  # s since 1970


HUMBLE, IRON = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS2_IRON)


def packed(kind, *values, store=HUMBLE):
    return bytes(store.serialize_cdr(store.types[kind](*values), kind))


def header(stamp, frame):
    time = HUMBLE.types["builtin_interfaces/msg/Time"](*divmod(round(1e9 * stamp), 10**9))
    return HUMBLE.types["std_msgs/msg/Header"](time, frame)


def joint_state(stamp, names, position):
    none = np.zeros(0)
    return packed(JOINTS, header(stamp, ""), list(names), np.array(position, float), none, none)


def range_(stamp, frame, distance, low=0.02, high=4.0, variance=None):
    values = (header(stamp, frame), 1, 0.4, low, high, distance)
    return (
        packed(RANGE, *values) if variance is None else packed(RANGE, *values, variance, store=IRON)
    )


def zones(stamp, frame, points):
    """A cloud of one row of points, with an intensity after each."""
    field, names = HUMBLE.types["sensor_msgs/msg/PointField"], ("x", "y", "z", "intensity")
    fields = [field(name, 4 * i, 7, 1) for i, name in enumerate(names)]
    data = np.frombuffer(b"".join(struct.pack("<4f", *p, 1.0) for p in points), np.uint8)
    shape, steps = (1, len(points)), (16, 16 * len(points))
    return packed(POINTS, header(stamp, frame), *shape, fields, False, *steps, data, True)


def text(words):
    return packed(TEXT, words)


def write_mcap(path, messages, compression=CompressionType.ZSTD, **more):
    """Write (topic, type, time in s, data) of all messages."""
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, **more)
        writer.start(profile="ros2", library="tests")
        channels = {}
        for topic, kind, time, data in messages:
            if topic not in channels:
                schema = writer.register_schema(kind, "ros2msg", b"# not read")
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            at = round(1e9 * time)
            writer.add_message(channels[topic], at, data, at)
        writer.finish()


_TABLES = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
INSERT INTO schema VALUES (3, 'humble');
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
  timestamp INTEGER NOT NULL, data BLOB NOT NULL);
"""


def write_sqlite(folder, messages):
    """Write a bag's folder with one file of SQLite."""
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: not read\n")
    database = sqlite3.connect(folder / "bag_0.db3")
    database.executescript(_TABLES)
    topics = {}
    for topic, kind, time, data in messages:
        if topic not in topics:
            topics[topic] = len(topics) + 1
            row = (topics[topic], topic, kind, "cdr", "")
            database.execute("INSERT INTO topics VALUES (?, ?, ?, ?, ?)", row)
        row = (topics[topic], round(1e9 * time), data)
        database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row)
    database.commit()
    database.close()


def rig_messages(q, joints, setup):
    """A rig that states joint angles 50 times a second, each sensor its own distance 10 times."""
    told = []
    for n, row in enumerate(q):
        time = START + n / 50
        told.append(("/joint_states", JOINTS, time, joint_state(time, joints, row)))
        for ring, sensor in setup.labels if n % 5 == 2 else ():
            data = range_(time, f"tof_{ring}_{sensor}", 0.5 + 0.1 * ring + 0.01 * sensor)
            told.append(("/tof", RANGE, time, data))
    return told


def recorded_messages(gathered, joints, topic="/tof", frame="tof_{ring}_{sensor}"):
    """All that a replayed recording holds, as messages of ROS 2 in the order of time."""
    told = []
    for state in gathered.states:
        data = joint_state(START + state.clock, joints, state.q)
        told.append((state.time, "/joint_states", JOINTS, data))
    for ring, one in gathered.frames:
        for k, (distance, status) in enumerate(zip(one.distance, one.status, strict=True)):
            read = {0: float(distance), 1: math.inf, 3: math.nan}[int(status)]
            data = range_(START + one.clock, frame.format(ring=ring, sensor=k), read)
            told.append((one.time, topic, RANGE, data))
    for time, note in gathered.said:
        words = {"begin": f"{note.get('step')} {note.get('number')}", "end": "end"}
        if note["what"] in words:
            data = text(words[note["what"]].replace("self 0", "self"))
            told.append((time, "/place_rings/step", TEXT, data))
    told.sort(key=lambda one: one[0])
    return [(name, kind, START + time, data) for time, name, kind, data in told]


def write_tables(folder, gathered, joints):
    """Write joints.csv, readings.csv and steps.csv of a replayed recording."""
    folder.mkdir()
    rows = [",".join(["time", *joints])]
    rows += [",".join(map(repr, [START + s.time, *map(float, s.q)])) for s in gathered.states]
    (folder / "joints.csv").write_text("\n".join(rows) + "\n")
    rows = ["time,sensor,range_m"]
    for ring, one in sorted(gathered.frames, key=lambda pair: pair[1].time):
        for k, (distance, status) in enumerate(zip(one.distance, one.status, strict=True)):
            read = {0: repr(float(distance)), 1: "inf", 3: "nan"}[int(status)]
            rows.append(f"{START + one.time!r},tof_{ring}_{k},{read}")
    (folder / "readings.csv").write_text("\n".join(rows) + "\n")
    rows = ["time,step"]
    for time, note in gathered.said:
        if note["what"] in ("begin", "end"):
            words = "end" if note["what"] == "end" else f"{note['step']} {note['number']}"
            rows.append(f"{START + time!r},{words}")
    (folder / "steps.csv").write_text("\n".join(rows) + "\n")
