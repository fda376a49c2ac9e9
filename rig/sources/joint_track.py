"""Joint angles over time, from the messages of a file."""

from array import array

import numpy as np
from jaxtyping import Float

from ...coverage.robots.robot import Robot
from ...formats.errors import shown
from ..robot.state import State
from ..robot.vetting import GAP
from .messages import JointMessage, refuse

RATE = 150.0  # states a second that are kept
_MOST = 1_000_000  # states
_TURNS = 4 * np.pi  # rad; no joint turns farther
_FASTEST, _JUMP = 20.0, 0.05  # rad/s and rad; a step beyond both is an error
_SLOWEST = 0.5  # s, largest median period of states
_PERIODS = 2.5  # gap between states, in median periods, above which no angles are interpolated
STANDING = 1.0  # s; a robot at the same place before and after such a gap stood still
_SAME = np.radians(0.1)  # rad
_SHOWN = 12  # names in an error


class JointTrack:
    """Collects the states of a robot.

    Args:
        robot: the robot.
        names: index of each of its joints by name.
    """

    def __init__(self, robot: Robot, names: dict[str, int]) -> None:
        self._robot, self._names = robot, names
        followers = {m.joint for m in robot.chain.mimics}
        self._wanted = [i for i in range(len(robot.chain)) if i not in followers]
        self._time, self._clock, self._q = array("d"), array("d"), array("d")
        self._last = -np.inf
        self._others: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._time)

    def take(self, name: str, message: JointMessage) -> None:
        """Add a message of file ``name``; one without any of the robot's joints is skipped.

        Raises:
            UserError: if it lacks a joint, or holds angles that cannot be true.
        """
        where = f"{shown(message.topic)} at {message.time:.3f} s"
        known = [(self._names[n], i) for i, n in enumerate(message.names) if n in self._names]
        if not known:
            if len(self._others) < _SHOWN:
                self._others |= dict.fromkeys(message.names)
            return
        if message.time < self._last:
            found = f"a time {self._last - message.time:.3g} s before the last"
            raise refuse(name, where, found, "times in order")
        q = np.zeros(len(self._robot.chain))
        places = dict(known)
        if len(places) < len(known):
            raise refuse(name, where, "a joint twice", "each joint once")
        if lacks := [self._robot.chain.joints[j] for j in self._wanted if j not in places]:
            wanted = f"also {', '.join(lacks)}; --map JOINT=NAME states other names"
            raise refuse(name, where, f"the joints {_listed(message.names)}", wanted)
        for joint, place in places.items():
            q[joint] = message.position[place]
        self._check(name, where, q, message.time)
        if message.time - self._last < 1 / RATE and len(self):
            return
        if len(self) >= _MOST:
            raise refuse(name, where, f"more than {_MOST} states", "fewer; split the file")
        self._last = message.time
        self._time.append(message.time)
        self._clock.append(message.clock)
        self._q.extend(self._robot.chain.settled(q))

    def _check(self, name: str, where: str, q: Float[np.ndarray, " J"], time: float) -> None:
        if not np.isfinite(q).all() or np.abs(q).max() > _TURNS:
            joint = int(np.argmax(~np.isfinite(q) | (np.abs(q) > _TURNS)))
            found = f"{self._robot.chain.joints[joint]} at {q[joint]:g} rad"
            raise refuse(name, where, found, f"a number from {-_TURNS:.4g} to {_TURNS:.4g} rad")
        if not len(self):
            return
        step = np.abs(q - np.array(self._q[-len(q) :]))
        joint = int(step.argmax())
        seconds = max(time - self._last, 1 / RATE)
        if step[joint] > max(_JUMP, _FASTEST * seconds):
            found = f"{self._robot.chain.joints[joint]} {step[joint]:.3g} rad from the last"
            wanted = f"at most {_FASTEST:g} rad/s; unwrap angles that jump at half a turn"
            raise refuse(name, where, found, wanted)

    def require(self, name: str) -> None:
        """Raise UserError if file ``name`` held too few states."""
        if len(self) < 2:
            found = f"{len(self)} states of {self._robot.name}"
            if self._others:
                found += f", and the joints {_listed(tuple(self._others))}"
            joints = ", ".join(self._robot.chain.joints)
            wanted = f"states of {joints}; --map JOINT=NAME states other names"
            raise refuse(name, "joint states", found, wanted)
        if self.period > _SLOWEST:
            found = f"a state every {self.period:.2g} s"
            raise refuse(name, "joint states", found, f"at least one every {_SLOWEST:g} s")

    @property
    def time(self) -> Float[np.ndarray, " T"]:
        """Times, s."""
        return np.array(self._time)

    @property
    def q(self) -> Float[np.ndarray, "T J"]:
        """Joint angles, rad."""
        return np.array(self._q).reshape(len(self), -1)

    @property
    def period(self) -> float:
        """Median time between two states, s."""
        return float(np.median(np.diff(self.time)))

    @property
    def gap(self) -> float:
        """Gap between states above which nothing is interpolated, s."""
        return max(GAP, _PERIODS * self.period)

    def states(self) -> list[State]:
        """Return the states; the safety status of a file is unknown and counts as normal."""
        return [
            State(time, clock, q, np.zeros(len(q)))
            for time, clock, q in zip(self._time, self._clock, self.q, strict=True)
        ]

    def gaps(self) -> Float[np.ndarray, " g"]:
        """Return the gaps in which no angles are known, s."""
        between, moved = np.diff(self.time), np.abs(np.diff(self.q, axis=0)).max(axis=1)
        stood = (between <= STANDING) & (moved <= _SAME)
        large: np.ndarray = between[(between > self.gap) & ~stood]
        return large


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(name[:60] for name in names[:_SHOWN]) + ", …" * (len(names) > _SHOWN) or "none"
