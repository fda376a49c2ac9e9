"""Cycles of a ring, from the times of its frames.

A ring that fires in slots sends the first frame of a cycle when the cycle begins, and the others at
equal times after it, so that the last is followed by the next a little sooner. The times of its
frames, folded by the length of a cycle, are a comb; where it fits best, a cycle begins.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...formats.firmware.ring_pace import RingPace

_BIN = 0.5e-3  # s, of folded times
_FAR = 10e-3  # s; frames farther from the comb count alike
_ALIKE = 3e-3  # s, over the number of frames in a cycle; beginnings that fit so much worse may be
_DRIFT = 1e-3  # s, largest error of the first estimate of a cycle
_FEWEST = 5  # cycles
_AROUND = 5e-3  # s, tolerance of a slot


@dataclass(frozen=True)
class FrameComb:
    """Cycles of a ring; times are those of the host."""

    cycle: float
    """Length of a cycle, s."""
    origins: Float[np.ndarray, " m"]
    """Times at which a cycle may begin, s; those that fit about as well as the best."""
    cycles: float
    """Number of cycles in the time of the frames."""

    def behind(self, other: "FrameComb") -> float:
        """Return how much later the cycles begin than those of another ring that runs as long, s:
        the largest difference in that time, or what is left of it with the best of all beginnings.
        """
        cycle = other.cycle
        drift = (self.cycle - cycle) * self.cycles / 2 * np.array([[[-1.0]], [[1.0]]])
        apart = self.origins[:, None] - other.origins + drift
        apart -= cycle * np.round(apart / cycle)
        worst = np.abs(apart).max(axis=0)
        pair = np.unravel_index(worst.argmin(), worst.shape)
        each = apart[:, pair[0], pair[1]]
        return float(each[np.abs(each).argmax()])


def cycle_of(
    time: Float[np.ndarray, " n"], number: Int[np.ndarray, " n"], frames: int
) -> float | None:
    """Return the time between two frames of the same number in their cycles, s; lost frames do not
    change it. None if too few frames arrived.

    Args:
        time: when frames were sent, s.
        number: their numbers, ascending.
        frames: number of frames in a cycle.
    """
    at = np.searchsorted(number, number + frames)
    there = at < len(number)
    there[there] = number[at[there]] == (number + frames)[there]
    if there.sum() < _FEWEST * frames:
        return None
    return float(np.median(time[at[there]] - time[there]))


def frame_comb(time: Float[np.ndarray, " n"], cycle: float, pace: RingPace) -> FrameComb:
    """Return the cycles of a ring.

    Args:
        time: when its frames were sent, s, about 0 in their middle.
        cycle: the length of a cycle, s, within a millisecond.
        pace: the ring's pace.
    """
    cycles = float(np.ptp(time)) / cycle
    step = 2 * _BIN / max(cycles, 1.0)
    lengths = cycle + step * np.arange(-round(_DRIFT / step), round(_DRIFT / step) + 1)
    misfits = [_misfit(time, length, pace) for length in lengths]
    best = int(np.argmin([each.min() for each in misfits]))
    misfit = misfits[best]
    alike = np.flatnonzero(misfit <= misfit.min() + _ALIKE / pace.frames)
    return FrameComb(float(lengths[best]), lengths[best] * alike / len(misfit), cycles)


def _misfit(time: Float[np.ndarray, " n"], cycle: float, pace: RingPace) -> Float[np.ndarray, " b"]:
    """Return how far frames are from the comb that begins in each bin of a cycle, s: the mean."""
    bins = max(round(cycle / _BIN), 1)
    share = np.bincount((time / cycle % 1 * bins).astype(int) % bins, minlength=bins) / len(time)
    teeth = pace.frame_s * np.arange(pace.frames)
    off = np.arange(bins)[:, None] * cycle / bins - teeth
    near = np.abs(off - cycle * np.round(off / cycle)).min(axis=1).clip(max=_FAR)
    turned = np.conj(np.fft.rfft(near)) * np.fft.rfft(share)
    misfit: np.ndarray = np.fft.irfft(turned, bins)
    return misfit


def within_slot(
    before: Float[np.ndarray, " n"],
    after: Float[np.ndarray, " n"],
    sensor: Int[np.ndarray, " n"],
    pace: RingPace,
    comb: FrameComb,
) -> Bool[np.ndarray, " n"]:
    """Return which new readings may have come in the slots of their sensors, for the beginning of a
    cycle with the most of them.

    Args:
        before: time of the last frame without the new reading, s.
        after: time of the first frame with it, s.
        sensor: its sensor.
        pace: the ring's pace, with slots.
        comb: its cycles.
    """
    slots = pace.slots
    assert slots is not None
    slot = np.array(slots.slot)[sensor]
    begin = np.array(slots.starts_us)[slot] / 1e6 - _AROUND
    end = np.array(slots.ends_us)[slot] / 1e6 + _AROUND
    origin = comb.origins[:, None]
    turns = np.ceil((before - end - origin) / comb.cycle)  # of the first slot that ends after it
    inside = origin + begin + turns * comb.cycle < after
    most: np.ndarray = inside[int(inside.sum(axis=1).argmax())]
    return most
