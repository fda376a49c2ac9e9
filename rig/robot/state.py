"""State of the robot, whether it is plausible, and what to do where the robot is not running."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float

JOINTS = 6  # of every robot that ur-rtde supports
# a short package spoils the last
VARIABLES = (
    *("actual_q", "actual_qd", "runtime_state", "safety_status_bits", "robot_mode"),
    "timestamp",
)
_LAYOUT, _LAYOUT_WITHOUT_MODE = struct.Struct("<d6d6dIIi"), struct.Struct("<d6d6dII")
# safety status bits; all higher bits mean stops, faults and violations
NORMAL, REDUCED = 1 << 0, 1 << 1
TURN = 2 * math.pi + 0.1  # rad; no joint that does not turn without end reports more
_MOST_SPEED = 2 * math.pi + 0.2  # rad/s: of the fastest joint (UR3e, third wrist)
_MOST_ACCELERATION = 40.0  # rad/s², maximum that the controller accepts
_LONGEST = 10.0  # s between states; a larger step of the clock is an error
_SLACK = 0.002  # rad, for noise of the encoders and filtered speeds


class RobotMode(IntEnum):
    """Values of the variable robot_mode."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING_FIRMWARE = 8


_REMEDIES = {
    RobotMode.NO_CONTROLLER: "start its controller",
    RobotMode.DISCONNECTED: "connect the arm to its controller, then switch it on",
    RobotMode.CONFIRM_SAFETY: "confirm its safety configuration on the pendant",
    RobotMode.BOOTING: "wait until it has started",
    RobotMode.POWER_OFF: "switch the arm on and release the brakes",
    RobotMode.POWER_ON: "release the brakes",
    RobotMode.IDLE: "release the brakes",
    RobotMode.BACKDRIVE: "end the backdrive on the pendant",
    RobotMode.UPDATING_FIRMWARE: "wait until its firmware is updated",
}


def not_running(mode: int | None) -> str | None:
    """Return why a robot in this mode does not move, and the remedy, or None if it can; None also
    for a mode that is not known.
    """
    if mode is None or mode == RobotMode.RUNNING:
        return None
    if mode not in list(RobotMode):
        return f"robot mode {mode}: unknown, wanted: {RobotMode.RUNNING.value} (RUNNING)"
    known = RobotMode(mode)
    return f"robot mode {known.name}: {_REMEDIES[known]}"


@dataclass(frozen=True)
class State:
    """State of the robot."""

    time: float
    """Arrival, s of the host's monotonic clock."""
    clock: float
    """s of the robot's clock."""
    q: Float[np.ndarray, " J"]
    """Joint angles, rad."""
    speed: Float[np.ndarray, " J"]
    """Joint speeds, rad/s."""
    runtime: int = 1
    """Runtime state, as in RTDE."""
    safety: int = NORMAL
    """Safety status bits, as in RTDE."""
    mode: int | None = RobotMode.RUNNING
    """Robot mode, as in RTDE; None in recordings of versions that did not ask for it."""

    def pack(self) -> bytes:
        """Return everything but the arrival as bytes."""
        values = (self.clock, *self.q, *self.speed, self.runtime, self.safety)
        if self.mode is None:
            return _LAYOUT_WITHOUT_MODE.pack(*values)
        return _LAYOUT.pack(*values, self.mode)

    @staticmethod
    def unpack(time: float, data: bytes) -> "State":
        """Decode a state that arrived at ``time`` s; raise ValueError if ``data`` has another
        length.
        """
        mode: int | None = None
        if len(data) == _LAYOUT_WITHOUT_MODE.size:
            clock, *values, runtime, safety = _LAYOUT_WITHOUT_MODE.unpack(data)
        elif len(data) == _LAYOUT.size:
            clock, *values, runtime, safety, mode = _LAYOUT.unpack(data)
        else:
            raise ValueError(f"a state of {len(data)} bytes, allowed: {_LAYOUT.size}")
        q, speed = np.array(values[:JOINTS]), np.array(values[JOINTS:])
        return State(time, clock, q, speed, runtime, safety, mode)


def implausible(
    state: State, farthest: Float[np.ndarray, " J"] | float = TURN, names: Sequence[str] = ()
) -> str | None:
    """Return why a single state is impossible, or None.

    Args:
        state: the state.
        farthest: largest angle of each joint, rad.
        names: of the joints; without them, they are numbered.
    """
    if not (
        math.isfinite(state.clock) and np.isfinite(state.q).all() and np.isfinite(state.speed).all()
    ):
        return "a number that is not finite"
    if (over := np.abs(state.q) > farthest).any():
        joint = int(over.argmax())
        name = names[joint] if names else f"joint {joint}"
        most = math.degrees(np.broadcast_to(farthest, over.shape)[joint])
        return f"{name} at {math.degrees(state.q[joint]):.4g}°, allowed: {-most:.4g} to {most:.4g}°"
    if np.abs(state.speed).max() > _MOST_SPEED:
        return f"a joint at {math.degrees(state.speed[np.abs(state.speed).argmax()]):.4g}°/s"
    return None


def impossible(before: State, state: State) -> str | None:
    """Return why one state cannot follow another, or None: no joint moves farther than its speeds
    and the maximum acceleration allow.
    """
    seconds = state.clock - before.clock
    if not 0 < seconds <= _LONGEST:
        return f"the robot's clock went by {seconds:.4g} s"
    fastest = np.maximum(np.abs(before.speed), np.abs(state.speed))
    allowed = fastest * seconds + _MOST_ACCELERATION * seconds**2 / 2 + _SLACK
    over = np.abs(state.q - before.q) - allowed
    if over.max() > 0:
        joint = int(over.argmax())
        return (
            f"joint {joint} went by {math.degrees(state.q[joint] - before.q[joint]):.4g}° in"
            f" {1000 * seconds:.4g} ms"
        )
    return None


_MOVE = struct.Struct("<6d2d")


def pack_move(q: Float[np.ndarray, " 6"], speed: float, acceleration: float) -> bytes:
    """Encode a motion to joint angles ``q`` (6,) rad, with ``speed`` rad/s and ``acceleration``
    rad/s² of the leading joint.
    """
    return _MOVE.pack(*q, speed, acceleration)


def unpack_move(data: bytes) -> tuple[tuple[float, ...], float, float]:
    """Return joint angles, speed and acceleration of a motion."""
    *q, speed, acceleration = _MOVE.unpack(data)
    return tuple(q), speed, acceleration
