"""Records become poses: laws of time, distance and rate; files that do not serve are one line; few
poses stand for many.
"""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.formats import motion_csv as reading
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.recorded_motion import read_record, with_record
from place_rings.objectives.pose_subset import representative
from place_rings.objectives.scene import Scene
from place_rings.objectives.trajectory import MotionRecord, Thinning, thin

from ..support import drawing
from ..support.refusals import refused
from ..support.scene_tables import reread, scene_table

HEADER = "t,q0,q1,q2,q3,q4,q5"
STILL = "0,0,0,0,0,0"


def motion(rng, seconds=20.0, rate=100.0):
    """A smooth random motion about the reference pose, by a few sines a joint."""
    t = np.arange(0.0, seconds + 0.5 / rate, 1 / rate)
    frequency, phase, size = (
        rng.uniform(0.02, 0.4, (3, 6)),
        rng.uniform(0, 6.28, (3, 6)),
        rng.uniform(0, 0.5, (3, 6)),
    )
    q = np.radians([0.0, -45, 60, -105, -90, 0]) + (
        size * np.sin(2 * math.pi * frequency * t[:, None, None] + phase)
    ).sum(1)
    return MotionRecord(t, q)


def nearest(record, poses):
    """Distance of each sample to the nearest pose, by the largest difference of any joint."""
    return np.min([np.abs(record.q - p.q).max(axis=1) for p in poses], axis=0)


@settings(max_examples=7)
@given(drawing.seeds, st.integers(1, 60), st.sampled_from([0.0, 1.0, 5.0]))
def test_weights_sum_to_the_time_and_every_sample_is_near_its_pose(seed, most, speed_weight):
    record = motion(np.random.default_rng(seed))
    found = thin(
        record, UR10, Thinning(poses=most, within=math.radians(5), speed_weight=speed_weight)
    )
    assert len(found.poses) <= most
    assert math.fsum(p.weight for p in found.poses) == pytest.approx(20.0, rel=1e-8)
    assert min(p.weight for p in found.poses) > 0
    assert found.within == pytest.approx(nearest(record, found.poses).max(), abs=1e-12)
    times = [p.time_s for p in found.poses]
    assert times == sorted(set(times))
    # cells of 10 ms between the samples
    assert len(found.poses) == most or found.within <= math.radians(5) + 0.02


def test_poses_are_spread_at_most_twice_as_wide_as_need_be():
    """On a straight line of length 1, n poses cannot be nearer than 1 / 2n; farthest points are
    within twice that, and the step to the middle of a group at most doubles it."""
    t = np.linspace(0, 10, 2001)
    found = thin(
        MotionRecord(t, np.outer(t / 10, np.eye(6)[1])), UR10, Thinning(poses=10, within=0.0)
    )
    assert len(found.poses) == 10
    assert found.within <= 4 / 20


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_still_robot_is_one_pose(noise):
    rng = np.random.default_rng(0)
    q = np.radians([10.0, -45, 60, -105, -90, 0]) + noise * rng.normal(size=(3000, 6))
    found = thin(MotionRecord(np.linspace(5, 65, 3000), q), UR10)
    assert len(found.poses) == 1
    assert found.poses[0].weight == pytest.approx(60)
    assert found.within < 1e-3


def test_dwell_and_speed_weigh():
    """Nine seconds at one place, one second of a swing by 1 rad at 0.5 to 1.3 m/s, then nine at
    another.
    """
    t = np.array([0.0, 9, 10, 19])
    q = np.repeat(np.radians([[0.0, -45, 60, -105, -90, 0]]), 4, axis=0)
    q[2:, 0] = 1.0
    record = MotionRecord(t, q)
    # v of the arc
    speed = np.linalg.norm(np.diff(forward(UR10.chain, q[1:3])[:, -1, :3, 3], axis=0)) / (
        2 * math.sin(0.5)
    )
    ends = {}
    for speed_weight in (0.0, 1.0):
        found = thin(record, UR10, Thinning(poses=20, within=0.0, speed_weight=speed_weight)).poses
        ends[speed_weight] = (
            sum(p.weight for p in found if min(abs(p.q[0]), abs(p.q[0] - 1)) < 0.02) / 19
        )
    assert ends[0.0] == pytest.approx(18.05 / 19, abs=0.01)
    moving = 1 + speed / 0.25
    assert ends[1.0] == pytest.approx((18 + 0.05 * moving) / (18 + moving), abs=0.02)


@settings(max_examples=5)
@given(drawing.seeds, st.sampled_from([20.0, 37.0, 250.0]))
def test_the_rate_and_the_direction_of_the_record_do_not_matter(seed, rate):
    """Poses of the same motion recorded at another rate, or backwards, lie as near to it, and what
    is averaged over them is the same: here where the TCP is, of which a pose tells by at most 1.3 m
    for each rad."""
    rng = np.random.default_rng(seed)
    record = motion(rng, rate=100.0)
    t = np.arange(0, 20.0001, 1 / rate)
    again = MotionRecord(
        t, np.stack([np.interp(t, record.time_s, joint) for joint in record.q.T], axis=1)
    )
    back = MotionRecord(record.time_s, record.q[::-1].copy())
    how = Thinning(poses=60, within=0.0)
    first = thin(record, UR10, how)
    for other in (thin(again, UR10, how), thin(back, UR10, how)):
        assert 0.8 < other.within / first.within < 1.25
        assert nearest(record, other.poses).max() < 1.25 * first.within
        means = []
        for found in (first, other):
            w = np.array([p.weight for p in found.poses])
            tcp = forward(UR10.chain, np.stack([p.q for p in found.poses]))[:, -1, :3, 3]
            means.append(w @ tcp / w.sum())
        assert means[0] == pytest.approx(means[1], abs=0.15 * first.within)


# ---- files


def write(path, record, names, separator=",", unit=1.0):
    with path.open("w") as file:
        writer = csv.writer(file, delimiter=separator)
        writer.writerow(names)
        writer.writerows(
            [t, *(unit * q)] for t, q in zip(record.time_s.tolist(), record.q, strict=True)
        )


@pytest.mark.parametrize(
    ("names", "separator"),
    [
        (["timestamp", *(f"actual_q_{i}" for i in range(6))], " "),
        (["time_s", *(f"q{i}" for i in range(6))], ","),
        (["Time", *UR10.chain.joints], ";"),
        (["t", *(f"{n}_joint" for n in UR10.chain.joints)], "\t"),
    ],
)
def test_what_is_recorded_is_read(tmp_path, names, separator):
    record = motion(np.random.default_rng(1), 1.0)
    write(tmp_path / "r.csv", record, names, separator)
    read = read_record(tmp_path / "r.csv", UR10)
    assert np.array_equal(read.time_s, record.time_s)
    assert np.array_equal(read.q, record.q)
    write(tmp_path / "d.csv", record, names, separator, 180 / math.pi)
    assert read_record(tmp_path / "d.csv", UR10, degrees=True).q == pytest.approx(
        record.q, abs=1e-12
    )


def test_other_columns_are_passed_over_and_blank_lines_too(tmp_path):
    order = range(5, -1, -1)
    head = ["timestamp", *(f"actual_qd_{i}" for i in range(6)), *(f"actual_q_{i}" for i in order)]
    rows = [
        [f"{0.1 * k:.1f}", *"9" * 6, *(f"{0.01 * k * i}" for i in order), "x"] for k in range(4)
    ]
    lines = [" ".join(row) for row in [[*head, "note"], *rows]]
    (tmp_path / "r.csv").write_text("\n\n".join(lines).replace("\n\n", "\n", 1))
    assert read_record(tmp_path / "r.csv", UR10).q[3] == pytest.approx([0.03 * i for i in range(6)])


START = f"{HEADER}\n0,{STILL}"
BAD_RECORDS = {
    "": "line 1 0 nothing t, time",
    "0,0,0": "line 1 0 0, 0, 0",
    "t,q0,q1,q2,q3,q4": "line 1, column q5 0",
    "t,q0,q1,q2,q3,q4,q5,q5": "line 1, column q5 2",
    "t,time,q0,q1,q2,q3,q4,q5": "line 1 2",
    HEADER: "0 2",
    START: "1 2",
    f"{START}\n1,0,0,0,0,nan,0": "line 3, column q4 nan",
    f"{START}\ninf,{STILL}": "line 3, column t inf",
    f"{START}\n\n1,0,x,0,0,0,0": 'line 4, column q1 "x"',
    f"{START}\n1,0,0": "line 3 3 7 1",
    f"{START}\n1,{STILL}\n1,{STILL}": "line 4, column t 1.0 1.0",
    f"{START}\n-1,{STILL}": "line 3, column t -1.0 0.0",
    f"{START}\n1,0,0,13,0,0,0": "line 3, column q2 13.0 -12.566 12.566 rad",
    f"{START}\n1e7,{STILL}": "1e+07 s 0.001 1e+06",
    f"{HEADER}\n" + "0" * 70_000: "line 2 65536",
    f'{START}\n1,"0\n2,0': "line",
    "t\0\n": "line 1",
}


@pytest.mark.parametrize(("text", "parts"), BAD_RECORDS.items(), ids=range(len(BAD_RECORDS)))
def test_a_bad_record_is_one_line(tmp_path, text, parts):
    (tmp_path / "r.csv").write_text(text)
    with refused(f"r.csv {parts}"):
        read_record(tmp_path / "r.csv", UR10)


def test_a_record_is_refused_past_the_most_rows_and_in_any_chunk(tmp_path, monkeypatch):
    path = tmp_path / "r.csv"
    path.write_text("\n".join([HEADER, *(f"{t},{STILL}" for t in range(10))]))
    monkeypatch.setattr(reading, "_CHUNK", 3)
    assert len(read_record(path, UR10).time_s) == 10
    monkeypatch.setattr(reading, "MOST_ROWS", 9)
    with refused("r.csv line 11 9"):
        read_record(path, UR10)
    monkeypatch.setattr(reading, "MOST_ROWS", 99)
    path.write_text("\n".join([HEADER, *(f"{t % 6},{STILL}" for t in range(10))]))
    with refused("r.csv line 8, column t 0.0 5.0"):
        read_record(path, UR10)


def test_what_is_no_record_is_one_line(tmp_path):
    (tmp_path / "bytes.csv").write_bytes(bytes(range(256)) * 9)
    for name in ("absent.csv", ".", "bytes.csv", "a\0b"):
        with pytest.raises(UserError):
            read_record(tmp_path / name, UR10)


def test_an_angle_cut_at_half_a_turn_is_one_line_and_the_same_made_whole_is_read(tmp_path):
    t = np.arange(0.0, 4.0, 0.008)
    whole = np.linspace(2.0, 4.5, len(t))
    q = np.stack([np.zeros_like(t)] * 5 + [whole], axis=1)
    cut = q.copy()
    cut[:, 5] = (whole + math.pi) % (2 * math.pi) - math.pi
    write(tmp_path / "cut.csv", MotionRecord(t, cut), HEADER.split(","))
    with refused("cut.csv wrist_3 0.008 s"):
        with_record(Scene.paper(), tmp_path / "cut.csv")
    write(tmp_path / "whole.csv", MotionRecord(t, q), HEADER.split(","))
    scene = with_record(Scene.paper(), tmp_path / "whole.csv")
    assert len(scene_table(scene)["poses"]) == len(scene.poses) > 1


@settings(max_examples=15, deadline=None)
@given(st.binary(max_size=200))
def test_no_bytes_do_worse_than_one_line(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("r") / "r.csv"
    path.write_bytes(HEADER.encode() + b"\n0," + STILL.encode() + b"\n" + data)
    line, read = "", None
    try:
        read = read_record(path, UR10)
    except UserError as error:
        line = str(error)
    assert "\n" not in line
    assert read is None or np.isfinite(read.q).all()


# ---- scenes


@pytest.fixture
def cell(tmp_path):
    """A folder with a record of 5 s and no scene yet."""
    write(tmp_path / "r.csv", motion(np.random.default_rng(2), 5.0), HEADER.split(","))
    return tmp_path


def test_a_scene_takes_its_poses_from_a_record(cell):
    (cell / "a.toml").write_text("trajectory = 'r.csv'")
    table = "file = 'r.csv'\nposes = 7\nspeed_weight = 0\nunit = 'rad'"
    (cell / "b.toml").write_text(f"over_poses = 'worst'\n[trajectory]\n{table}")
    a, b = read_scene(cell / "a.toml"), read_scene(cell / "b.toml")
    assert (len(b.poses), b.over_poses) == (7, "worst")
    assert (b.recorded.file, b.recorded.rows) == ("r.csv", 501)
    assert len(a.poses) > 7
    assert a.recorded.within < b.recorded.within
    again = reread(b)
    assert scene_table(again) == scene_table(b)
    assert [(p.weight, p.time_s) for p in again.poses] == [(p.weight, p.time_s) for p in b.poses]


TABLE = "[trajectory]\nfile = 'r.csv'\n"
BAD_SCENES = {
    "trajectory = 'absent.csv'": "absent.csv",
    "trajectory = '../r.csv'": 'trajectory.file "../r.csv" scene.toml',
    "trajectory = '/etc/hostname'": 'trajectory.file "/etc/hostname"',
    "trajectory = 'link.csv'": 'trajectory.file "link.csv"',
    "trajectory = 5": "trajectory 5 file",
    "trajectory = 'r.csv'\n[[poses]]\nq_deg = [0, 0, 0, 0, 0, 0]": "poses trajectory",
    TABLE + "poses = 0": "trajectory.poses 0 1",
    TABLE + "unit = 'grad'": 'trajectory.unit "grad" rad, deg',
    TABLE + "speed = 1": "trajectory.speed",
    "over_poses = 'best'": 'over_poses "best" mean, worst',
}


@pytest.mark.parametrize(("text", "parts"), BAD_SCENES.items())
def test_a_bad_trajectory_is_one_line(cell, text, parts):
    folder = cell / "inside"
    folder.mkdir()
    (folder / "r.csv").write_text((cell / "r.csv").read_text())
    (folder / "link.csv").symlink_to(cell / "r.csv")
    (folder / "scene.toml").write_text(text)
    with refused(parts):
        read_scene(folder / "scene.toml")
    ring = "[[rings]]\nlink = 'tool'\ncount = 8\n"
    (folder / "mine.toml").write_text(f"{ring}[scene.trajectory]\nfile = '../r.csv'")
    with refused('mine.toml scene.trajectory.file "../r.csv"'):
        read_proposal(folder / "mine.toml")


# ---- subsets


def test_subsets_stand_for_all():
    """Over the drawn start, each pose is met in proportion to its weight: the mean of the weights
    over many starts.
    """
    rng = np.random.default_rng(0)
    weights = rng.exponential(size=40)
    weights /= weights.sum()
    drawn = np.array([representative(weights, 9, rng) for _ in range(4000)])
    assert drawn.sum(axis=1) == pytest.approx(np.ones(4000))
    assert np.abs(drawn.mean(axis=0) - weights).max() < 4 * (1 / 9) / math.sqrt(4 * 4000)
    assert (np.count_nonzero(drawn, axis=1) <= 9).all()
    # of a function that changes slowly over the motion
    spread = np.sin(np.arange(40) / 6) @ drawn.T
    single = np.sqrt(weights @ np.sin(np.arange(40) / 6) ** 2 / 9)
    assert spread.std() < 0.5 * single  # far better than nine poses drawn one by one


def test_few_poses_are_all_looked_at():
    weights = np.array([0.2, 0.5, 0.3])
    assert representative(weights, 3, np.random.default_rng(0)) is weights


def test_a_record_of_another_robot_says_which_columns_it_wants(tmp_path):
    chain = replace(UR10.chain, joints=(*UR10.chain.joints, "seventh"))
    seven = replace(UR10, chain=chain, limits=None)
    assert len(seven.chain) == 7
    (tmp_path / "r.csv").write_text(HEADER + f"\n0,{STILL}\n")
    with refused("r.csv column q6"):
        read_record(tmp_path / "r.csv", seven)
