"""Joint states that cannot be true: numbers that are missing, zeros that a driver sends before it
knows the arm, and single states far from those before and after them.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.robots.joint_values import turned_near

JUMP = 0.05  # rad; a smaller step is no error
_FASTEST = 2 * np.pi + 0.2  # rad/s; a faster step there and back is none of an arm
_LONG = 10.0  # s; an arm stands for so long at all zeros, a driver does not send them for so long
_FEW = 3  # states that a jump and its return may enclose


class JointSteps:
    """How far apart the states of a robot are.

    Args:
        time: s, in order.
        q: joint angles, rad.
        endless: which joints turn without end.
        shortest: s; the time between two states counts as at least this.
    """

    def __init__(
        self,
        time: Float[np.ndarray, " T"],
        q: Float[np.ndarray, "T J"],
        endless: Bool[np.ndarray, " J"],
        shortest: float,
    ) -> None:
        self.time, self.q = time, q
        self._endless, self._shortest = endless, shortest

    def too_far(
        self,
        before: Int[np.ndarray, " n"] | int,
        after: Int[np.ndarray, " n"] | int,
        fastest: float = _FASTEST,
        longest: float = np.inf,
    ) -> Bool[np.ndarray, "*n J"]:
        """Return which joints cannot go from one state to another.

        Args:
            before, after: indices of the states.
            fastest: rad/s of a joint.
            longest: s; the arm moves for no longer, however far apart the states are.
        """
        a, b = self.q[before], self.q[after]
        step = np.abs(np.where(self._endless, turned_near(b, a), b) - a)
        seconds = np.clip(self.time[after] - self.time[before], self._shortest, longest)
        most: np.ndarray = np.maximum(JUMP, fastest * np.asarray(seconds))
        return np.asarray(step > most[..., None])


def glitches(steps: JointSteps, gap: float) -> dict[str, Bool[np.ndarray, " T"]]:
    """Return which states cannot be true, by what is wrong with them.

    States of exact zeros are wrong if the arm is too far from zero in the states before and after
    them. An arm that stands at zero leaves it in steps; where states are missing for longer than
    ``gap``, nothing shows that it did, unless it stood there for 10 s.

    Args:
        steps: the states.
        gap: s between two states, above which others are missing.
    """
    lost = ~np.isfinite(steps.q).all(axis=1)
    zeros = np.zeros(len(lost), bool)
    zeros[_false_zeros(steps, np.flatnonzero(~lost), gap)] = True
    jumps = np.zeros(len(lost), bool)
    jumps[_there_and_back(steps, np.flatnonzero(~lost & ~zeros))] = True
    return {"not finite": lost, "all zeros": zeros, "a jump there and back": jumps}


def _false_zeros(steps: JointSteps, kept: Int[np.ndarray, " n"], gap: float) -> list[int]:
    """Return those of the states ``kept`` that are zeros which their neighbours contradict."""
    found = list[int]()
    zero = (steps.q[kept] == 0).all(axis=1)
    edges = [0, *(np.flatnonzero(np.diff(zero)) + 1).tolist(), len(kept)]
    for a, b in pairwise(edges):
        if b <= a or not zero[a]:
            continue
        stood = steps.time[kept[b - 1]] - steps.time[kept[a]] >= _LONG
        longest = np.inf if stood else gap
        sides = [i for i in (a, b) if 0 < i < len(kept)]
        far = (steps.too_far(int(kept[i - 1]), int(kept[i]), longest=longest) for i in sides)
        if sides and all(joints.any() for joints in far):
            found += kept[a:b].tolist()
    return found


def _there_and_back(steps: JointSteps, kept: Int[np.ndarray, " n"]) -> list[int]:
    """Return those of the states ``kept`` that the arm jumps to, and back from."""
    if len(kept) < 3:
        return []
    found = list[int]()
    jumps = steps.too_far(kept[:-1], kept[1:]).any(axis=1)
    edges = [0, *(np.flatnonzero(jumps) + 1).tolist(), len(kept)]
    last = edges[1] - 1  # of the states before the jump
    for a, b in pairwise(edges[1:]):
        back = b < len(kept) and not steps.too_far(kept[last], kept[b]).any()
        if back and b - a <= _FEW:
            found += kept[a:b].tolist()
        else:
            last = b - 1
    return found
