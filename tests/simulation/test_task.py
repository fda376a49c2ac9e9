"""The paper's task as a timed trajectory: limits kept, every product reached, and where the robot
is fastest.
"""

import math

import numpy as np
import pytest
from place_rings.coverage.robots.built_in import PAPER_ROBOTS, ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.simulation import pick_and_place as task


@pytest.fixture(scope="module", params=PAPER_ROBOTS)
def robot_and_motion(request):
    robot = ROBOTS[request.param]
    return robot, task.pick_and_place(robot)


def test_limits_are_kept(robot_and_motion):
    _, motion = robot_and_motion
    dt = motion.time_s[1]
    speed = np.diff(motion.q, axis=0) / dt
    assert np.all(np.degrees(np.abs(speed)) <= np.array(task.SPEED_DEG) + 1e-6)
    # between rests of two moves the trapezoids of neighbouring samples meet: no kink is sharper
    # than the limit
    assert np.degrees(np.abs(np.diff(speed, axis=0) / dt)).max() <= task.ACCELERATION_DEG * 1.01


def test_every_product_is_picked_and_placed_from_above(robot_and_motion):
    robot, motion = robot_and_motion
    frames = forward(robot.chain, motion.q)
    low = frames[:, -1, 2, 3] < task.LOW + 1e-6
    starts = np.flatnonzero(np.diff(low.astype(int)) > 0)
    assert len(starts) == 20
    tool = robot.mounts[-1]
    down = frames[starts + 1, tool.frame, :3, :3] @ tool.axis
    np.testing.assert_allclose(down, np.tile([0, 0, -1], (20, 1)), atol=1e-5)
    xy = np.round(frames[starts + 1, -1, :2, 3], 4)
    assert len(np.unique(xy, axis=0)) == 20
    assert np.all((xy[::2, 1] < 0) & (xy[1::2, 1] > 0))  # from one table to the other
    reach = np.hypot(*xy.T)
    assert reach.min() >= min(task.RADII) - 1e-3
    assert reach.max() <= math.hypot(max(task.RADII), 2 * task.PITCH) + 1e-3


def test_the_tcp_is_fastest_in_the_middle_of_a_half_turn(robot_and_motion):
    robot, motion = robot_and_motion
    top = task.fastest(robot, motion)
    assert motion.swing[top]
    still = np.flatnonzero(~motion.swing)
    first, last = still[still < top].max(), still[still > top].min()
    turn = motion.q[last - 1, 0] - motion.q[first, 0]
    assert math.degrees(abs(turn)) == pytest.approx(180, abs=2)
    assert motion.q[top, 0] == pytest.approx(
        (motion.q[last - 1, 0] + motion.q[first, 0]) / 2, abs=math.radians(2)
    )
    # From rest over half a turn and back to rest at the greatest acceleration: sqrt(a * 180)
    # degrees a second, at the arm's length from the base axis.
    tcp = forward(robot.chain, motion.q[top])[-1, :2, 3]
    speed = math.radians(math.sqrt(task.ACCELERATION_DEG * 180)) * np.hypot(*tcp)
    assert motion.tcp_speed(robot)[top] == pytest.approx(speed, rel=0.01)


def test_fewer_samples_are_of_the_same_motion():
    motion = task.pick_and_place(UR10)
    few = motion.every(10)
    assert np.all(np.diff(few.time_s) > 0)
    at = np.searchsorted(motion.time_s, few.time_s)
    np.testing.assert_allclose(
        few.q, motion.q[at], atol=np.radians(task.SPEED_DEG).max() / 200 + 1e-9
    )
    assert few.swing.mean() == pytest.approx(motion.swing.mean(), abs=0.01)


def test_a_place_out_of_reach_is_refused():
    with pytest.raises(ValueError, match="ur10"):
        task.reach_down(UR10, np.array([1.5, 0.0, 0.1]))
