"""Joint states that cannot be true are left out, counted and named: zeros that a driver sends
(UniversalRobots/Universal_Robots_ROS_Driver, issue 302), numbers that are missing, single jumps. An
arm that stands at zero stays.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.rig.sources.joint_glitches import JUMP
from place_rings.rig.sources.standstills import standstills

from ..support.refusals import refused
from .bags import rig_messages, write_mcap, write_sqlite
from .cell import SCENE, SETUP
from .commands import call, proposed, result_of
from .test_joint_turns import tracked, written

ROBOT = SCENE.robot
POSE = np.array([0.3, -0.9, 1.2, -1.9, -1.57, 0.4])
rates = st.sampled_from([20, 50, 125, 500])


def moving(rng, rows, rate):
    """A smooth motion about a pose far from zero, with standstills at both ends."""
    t = np.arange(rows) / rate
    way = np.clip((t - 0.25 * t[-1]) / (0.5 * t[-1]), 0, 1)
    far = rng.uniform(-0.5, 0.5, 6) * min(1.0, t[-1] / 3)
    return t, POSE + np.sin(math.pi * way)[:, None] ** 2 * far


def counts(track):
    """How many states a track left out, by what is wrong with them."""
    return {
        line.split(" ", 1)[1].split(", first")[0]: int(line.split()[0]) for line in track.left_out
    }


@given(st.integers(0, 2**32 - 1), rates, st.floats(0.05, 3), st.booleans(), st.integers(0, 3))
def test_false_zeros_are_left_out_wherever_they_are(seed, rate, seconds, gap, stray):
    """At the start, with a gap after them or none, at the end, and single ones."""
    rng = np.random.default_rng(seed)
    rate = min(rate, 125)  # all rows are kept
    t, q = moving(rng, 4 * rate, rate)
    first = max(round(seconds * rate), 1)
    t = np.concatenate([np.arange(first) / rate, t + first / rate + 2.0 * gap])
    q = np.concatenate([np.zeros((first, 6)), q])
    single = first + 5 + 7 * rng.choice(len(q) // 8, stray, replace=False)
    single = single[single < len(q) - 2]
    q[single] = 0.0
    track = tracked(ROBOT, t, q)
    assert counts(track) == {"all zeros": first + len(single)}
    kept = np.abs(q).max(axis=1) > 0
    np.testing.assert_array_equal(track.q, q[kept])
    still = standstills(track.time, track.q, 1.0)
    assert all(np.abs(s.q).max() > 0.1 for s in still)


@given(st.integers(0, 2**32 - 1), st.sampled_from([20, 50, 125]), st.integers(0, 3))
def test_an_arm_that_stands_at_zero_stays(seed, rate, kind):
    """Alone; left smoothly; with a noise of its encoders; or so long that no driver sends it."""
    rng = np.random.default_rng(seed)
    rows = {0: 2, 1: 2, 2: 2, 3: 12}[kind] * rate
    q = np.zeros((rows, 6))
    if kind == 2:
        q += rng.normal(0, 1e-4, q.shape) * (rng.random((rows, 1)) < 0.7)
    if kind in (1, 2):  # to the pose and back, half a second each
        way = (1 - np.cos(np.linspace(0, 2 * math.pi, 4 * rate)))[:, None] / 2
        q = np.concatenate([q, way * POSE, q])
    t = np.arange(len(q)) / rate
    if kind == 3:  # a second is missing in the record
        q = np.concatenate([q, np.tile(POSE, (rate, 1))])
        t = np.concatenate([t, t[-1] + 1.0 + np.arange(rate) / rate])
    track = tracked(ROBOT, t, q)
    assert track.left_out == []
    assert len(track) == len(q)


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([20, 50, 125]),
    st.lists(st.sampled_from(["nan", "inf", "jump", "far"]), min_size=1, max_size=6),
)
def test_single_states_that_cannot_be_are_left_out(seed, rate, kinds):
    rng = np.random.default_rng(seed)
    t, q = moving(rng, 6 * rate, rate)
    rows = 3 + 6 * rng.choice((len(q) - 8) // 6, len(kinds), replace=False)
    true, spoiled = q.copy(), np.zeros(len(q), bool)
    for row, kind in zip(rows, kinds, strict=True):
        joint, sign = rng.integers(6), rng.choice([-1, 1])
        least = max(JUMP, 6.6 / rate) + 0.3
        by = {"nan": np.nan, "inf": np.inf, "jump": rng.uniform(least, 3), "far": 1e6}[kind]
        q[row, joint] = q[row, joint] + sign * by
        spoiled[row] = True
    track = tracked(ROBOT, t, q)
    np.testing.assert_array_equal(track.q, true[~spoiled])
    found = counts(track)
    lost = sum(kind in ("nan", "inf") for kind in kinds)
    assert found.get("not finite", 0) == lost
    assert found.get("a jump there and back", 0) == len(kinds) - lost


@given(st.integers(0, 2**32 - 1), st.sampled_from([20, 50, 125]))
def test_an_arm_that_moves_as_fast_as_it_may_is_believed(seed, rate):
    """Each joint of a UR3e at up to 180°/s and 1000°/s², wrist 3 at 360°/s."""
    rng = np.random.default_rng(seed)
    fastest = np.radians([180] * 5 + [360])
    speed, q, states = np.zeros(6), POSE.copy(), []
    for _ in range(4 * rate):
        speed = np.clip(speed + rng.uniform(-17, 17, 6) / rate, -fastest, fastest)
        speed = np.where(np.abs(q - POSE) > 2.5, -np.sign(q - POSE) * np.abs(speed), speed)
        q = q + speed / rate
        states.append(q)
    assume(np.abs(states).max() < 6)
    assert tracked(ROBOTS["ur3e"], np.arange(len(states)) / rate, np.array(states)).left_out == []


def test_an_arm_that_stays_where_it_jumped_to_is_refused():
    q = np.tile(POSE, (100, 1))
    q[50:, 2] += 1.5
    with refused("elbow", "1.5 rad"):
        tracked(ROBOT, np.arange(100) / 50, q)
    with refused("0 states", "100 not finite"):
        tracked(ROBOT, np.arange(100) / 50, np.full((100, 6), np.nan))


def readings(path, seconds):
    rows = ["time,sensor,range_m"]
    rows += [
        f"{n / 10},tof_{ring}_{sensor},0.9"
        for n in range(int(10 * seconds))
        for ring, sensor in SETUP.labels
    ]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("kind", ["csv", "mcap", "db3"])
def test_a_check_says_what_it_left_out(tmp_path, kind):
    """In check.json, and its self check is that of the true pose."""
    q = np.tile(POSE, (200, 1))
    q[:100], q[150] = 0.0, np.nan
    small, out = proposed(tmp_path, SETUP, SCENE), tmp_path / "out"
    if kind == "csv":
        joints = written(tmp_path / "joints.csv", ROBOT, q)
        joints.write_text(joints.read_text().replace("nan", ""))  # as pandas writes it
        files = ["--joints", joints, "--readings", readings(tmp_path / "readings.csv", 4)]
    else:
        write = write_mcap if kind == "mcap" else write_sqlite
        write(tmp_path / f"rig.{kind}", rig_messages(q, ROBOT.chain.joints, SETUP))
        files = ["--joints", tmp_path / f"rig.{kind}"]
    words = ["check", small, *files, "--part", "self", "--voxel", "0.1"]
    assert call(*words, "--out", out) in (0, 1)
    result = result_of(out)
    (line,) = [w for w in result.warnings if "left out because" in w]
    assert "100 all zeros" in line
    assert "1 not finite" in line
    assert result.self_check.rings[0].frames < 20  # of 40: none at zero


def test_a_file_of_zeros_only_is_named(tmp_path):
    small = proposed(tmp_path, SETUP, SCENE)
    joints = written(tmp_path / "joints.csv", ROBOT, np.zeros((200, 6)))
    files = ["--joints", joints, "--readings", readings(tmp_path / "readings.csv", 4)]
    out = tmp_path / "out"
    assert call("check", small, *files, "--part", "self", "--out", out) in (0, 1)
    (line,) = result_of(out).warnings
    assert "joint states" in line
    assert "zero" in line
