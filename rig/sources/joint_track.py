"""Joint angles over time, from the messages of a file."""

from array import array

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import shown
from ...coverage.robots.robot import Robot
from ..robot.state import TURN, State
from ..robot.vetting import GAP
from .joint_glitches import JUMP, JointSteps, glitches
from .messages import JointMessage, listed, refuse

RATE = 150.0  # states a second that are kept
_MOST = 1_000_000  # states
_FASTEST = 20.0  # rad/s; a larger step that does not come back is refused
_SLOWEST = 0.5  # s, largest median period of states
_PERIODS = 2.5  # gap between states, in median periods, above which no angles are interpolated
STANDING = 1.0  # s; a robot at the same place before and after such a gap stood still
_SAME = np.radians(0.1)  # rad
_SHOWN = 12  # names in an error


class JointTrack:
    """Collects the states of a robot.

    ``close`` completes it; ``left_out`` then says which states could not be true, a line for each
    kind.

    Args:
        robot: the robot.
        names: index of each of its joints by name.
    """

    def __init__(self, robot: Robot, names: dict[str, int]) -> None:
        self._robot, self._names = robot, names
        followers = {m.joint for m in robot.chain.mimics}
        self._wanted = [i for i in range(len(robot.chain)) if i not in followers]
        self._time, self._clock, self._q = array("d"), array("d"), array("d")
        self._topic, self.left_out = "", list[str]()
        self._others: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._time)

    def take(self, name: str, message: JointMessage) -> None:
        """Add a message of file ``name``; one without any of the robot's joints is skipped.

        Raises:
            UserError: if it lacks a joint.
        """
        where = f"{shown(message.topic)} at {message.time:.3f} s"
        known = [(self._names[n], i) for i, n in enumerate(message.names) if n in self._names]
        if not known:
            if len(self._others) < _SHOWN:
                self._others |= dict.fromkeys(message.names)
            return
        if len(self) and message.time < self._time[-1]:
            found = f"a time {self._time[-1] - message.time:.3g} s before the last"
            raise refuse(name, where, found, "times in order")
        q = np.zeros(len(self._robot.chain))
        places = dict(known)
        if len(places) < len(known):
            raise refuse(name, where, "a joint twice", "each joint once")
        if lacks := [self._robot.chain.joints[j] for j in self._wanted if j not in places]:
            wanted = f"also {', '.join(lacks)}; --map JOINT=NAME states other names"
            raise refuse(name, where, f"the joints {listed(message.names, _SHOWN)}", wanted)
        for joint, place in places.items():
            q[joint] = message.position[place]
        q = self._robot.chain.settled(q)
        if len(self) and message.time - self._time[-1] < 1 / RATE and self._near(q):
            return
        if len(self) >= _MOST:
            raise refuse(name, where, f"more than {_MOST} states", "fewer; split the file")
        self._topic = message.topic
        self._time.append(message.time)
        self._clock.append(message.clock)
        self._q.extend(q)

    def _near(self, q: Float[np.ndarray, " J"]) -> bool:
        """Return whether a state is like the last, so that it may be left out."""
        finite = np.isfinite(q).all()
        return bool(finite and np.abs(q - np.array(self._q[-len(q) :])).max() <= JUMP)

    def close(self, name: str) -> None:
        """Leave out the states of file ``name`` that cannot be true, at its end.

        Raises:
            UserError: if the file holds too few states of the robot, an angle beyond its joint's
                limit, or a jump of the arm.
        """
        self._require(name)
        robot, steps = self._robot, self._steps()
        wrong = glitches(steps, self.gap)
        for what, which in wrong.items():
            if which.any():
                first = self._time[int(which.argmax())]
                self.left_out.append(f"{np.count_nonzero(which)} {what}, first at {first:.3f} s")
        kept = np.flatnonzero(~np.any(list(wrong.values()), axis=0))
        q = steps.q[kept]
        q = np.where(robot.continuous, np.unwrap(q, axis=0), q)
        self._time = array("d", steps.time[kept])
        self._clock = array("d", np.array(self._clock)[kept])
        self._q = array("d", q.ravel())
        self._require(name)
        self._check(name)

    def _steps(self) -> JointSteps:
        return JointSteps(self.time, self.q, self._robot.continuous, 1 / RATE)

    def _check(self, name: str) -> None:
        joints, q, topic = self._robot.chain.joints, self.q, shown(self._topic)
        farthest = self._robot.farthest(TURN)
        if (wrong := np.abs(q) > farthest).any():
            row, joint = np.argwhere(wrong)[0]
            most = farthest[joint]
            raise refuse(
                name,
                f"{topic} at {self._time[row]:.3f} s",
                f"{joints[joint]} at {q[row, joint]:g} rad ({np.degrees(q[row, joint]):.4g}°)",
                f"{-most:.4g} to {most:.4g} rad; in CSV, columns NAME_deg are in degrees",
            )
        each = np.arange(len(self))
        if (wrong := self._steps().too_far(each[:-1], each[1:], _FASTEST)).any():
            row, joint = np.argwhere(wrong)[0]
            step = abs(q[row + 1, joint] - q[row, joint])
            hint = "; unwrap angles that jump at half a turn" * bool(step > np.pi)
            raise refuse(
                name,
                f"{topic} at {self._time[row + 1]:.3f} s",
                f"{joints[joint]} {step:.3g} rad from the last",
                f"at most {_FASTEST:g} rad/s{hint}",
            )

    def _require(self, name: str) -> None:
        if len(self) < 2:
            found = f"{len(self)} states of {self._robot.name}"
            if self.left_out:
                found += f" beside {'; '.join(self.left_out)}"
            if self._others:
                found += f", and the joints {listed(self._others, _SHOWN)}"
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
