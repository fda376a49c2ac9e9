"""The paper's task as a timed joint trajectory: ten products are picked from one table and placed
into a box on another.

Between a pick and a place the base joint swings by 180 degrees. Every move is a joint move from
rest to rest, along a straight line in joint space, as fast as the limits allow (trapezoidal speed
profile). The paper gives neither positions nor limits; the constants below state our choice.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from ruckig import InputParameter, Result, Ruckig, Synchronization, Trajectory
from scipy.optimize import least_squares

from ..coverage.robots.kinematics import forward
from ..coverage.robots.robot import Robot
from ..objectives.scene import REFERENCE_POSE_DEG

# per second, the UR10's technical specification
SPEED_DEG = (120.0, 120.0, 180.0, 180.0, 180.0, 180.0)
# per second squared, the controller's default for a joint move
ACCELERATION_DEG = 80.0
RADII = (0.98, 1.10)  # m, from the base axis: two rows of products, five in each
PITCH = 0.12  # m, between the products of a row
LOW, HIGH = 0.12, 0.32  # m, height of the flange at a product and between the tables
GRIP = 0.4  # s, to close or open the gripper
_FINE = 200.0  # Hz, sampling rate for the search of the highest speed


@dataclass(frozen=True)
class TaskMotion:
    """A timed joint trajectory."""

    time_s: Float[np.ndarray, " T"]
    """Times in ascending order, s."""
    q: Float[np.ndarray, "T J"]
    """Joint angles, rad."""
    swing: np.ndarray
    """Whether the base is swinging, (T,)."""

    def tcp_speed(self, robot: Robot) -> Float[np.ndarray, " T"]:
        """Return the speed of the TCP (T,) in m/s, by central differences."""
        tcp = forward(robot.chain, self.q)[:, -1, :3, 3]
        speed: np.ndarray = np.linalg.norm(np.gradient(tcp, self.time_s, axis=0), axis=1)
        return speed

    def every(self, rate: float) -> "TaskMotion":
        """Return the motion resampled at ``rate`` Hz."""
        time = np.arange(0.0, self.time_s[-1], 1 / rate)
        q = np.stack([np.interp(time, self.time_s, joint) for joint in self.q.T], axis=1)
        return TaskMotion(time, q, self.swing[np.searchsorted(self.time_s, time)])


def reach_down(robot: Robot, place: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " J"]:
    """Solve the inverse kinematics for a flange at ``place`` (3,) m that points down.

    Returns:
        Joint angles (J,) in rad with the last joint at 0, near the reference pose turned about the
            base.

    Raises:
        ValueError: if the robot cannot reach the place.
    """
    tool = robot.mounts[-1]
    seed = np.radians(REFERENCE_POSE_DEG)
    at = forward(robot.chain, seed)[-1, :3, 3]
    seed[0] = math.atan2(place[1], place[0]) - math.atan2(at[1], at[0])

    def off(moving: Float[np.ndarray, " _"]) -> Float[np.ndarray, " 6"]:
        frame = forward(robot.chain, np.append(moving, 0.0))[tool.frame]
        return np.concatenate(
            [frame[:3, 3] - place, frame[:3, :3] @ tool.axis + np.array([0.0, 0.0, 1.0])]
        )

    solution = least_squares(off, seed[:-1], xtol=1e-14, ftol=1e-14, gtol=1e-14)
    if np.abs(solution.fun).max() > 1e-6:
        raise ValueError(f"{robot.name} cannot reach {np.round(place, 3).tolist()} m from above")
    return np.append(solution.x, 0.0)


def _places(azimuth: float) -> list[Float[np.ndarray, " 2"]]:
    """Return the positions (x, y) of ten products in m, in two rows across the direction
    ``azimuth`` rad."""
    along, across = (
        np.array([math.cos(azimuth), math.sin(azimuth)]),
        np.array([-math.sin(azimuth), math.cos(azimuth)]),
    )
    return [r * along + k * PITCH * across for r, k in itertools.product(RADII, range(-2, 3))]


def _move(
    start: Float[np.ndarray, " J"], end: Float[np.ndarray, " J"], rate: float
) -> Float[np.ndarray, "T J"]:
    """Return joint angles of a move from rest to rest at ``rate`` Hz, without the start."""
    question, answer = InputParameter(len(start)), Trajectory(len(start))
    question.current_position, question.target_position = start.tolist(), end.tolist()
    question.max_velocity = np.radians(SPEED_DEG).tolist()
    question.max_acceleration = [math.radians(ACCELERATION_DEG)] * len(start)
    question.synchronization = Synchronization.Phase
    if Ruckig(len(start)).calculate(question, answer) not in (Result.Working, Result.Finished):
        raise ValueError("no trajectory exists between two waypoints")
    steps = max(math.ceil(answer.duration * rate), 1)
    return np.array([answer.at_time(answer.duration * k / steps)[0] for k in range(1, steps + 1)])


def pick_and_place(robot: Robot, rate: float = _FINE) -> TaskMotion:
    """Return the whole task at about ``rate`` Hz.

    Each move takes a whole number of samples, so it may last up to one sample longer.
    """
    q, swing = [_above(robot, _places(-math.pi / 2)[0])[None]], [np.zeros(1, bool)]

    def add(part: Float[np.ndarray, "T J"], swings: bool) -> None:
        q.append(part)
        swing.append(np.full(len(part), swings))

    def go(end: Float[np.ndarray, " J"], swings: bool = False) -> None:
        add(_move(q[-1][-1], end, rate), swings)

    for pick, place in zip(_places(-math.pi / 2), _places(math.pi / 2), strict=True):
        for spot in (pick, place):
            above = _above(robot, spot)
            if len(q) > 1:
                go(above, swings=True)
            go(reach_down(robot, np.append(spot, LOW)))
            add(np.repeat(q[-1][-1:], math.ceil(GRIP * rate), axis=0), False)
            go(above)
    joints = np.concatenate(q)
    return TaskMotion(np.arange(len(joints)) / rate, joints, np.concatenate(swing))


def _above(robot: Robot, spot: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " J"]:
    return reach_down(robot, np.append(spot, HIGH))


def fastest(robot: Robot, motion: TaskMotion) -> int:
    """Return the sample at which the TCP is fastest."""
    return int(np.argmax(motion.tcp_speed(robot)))
