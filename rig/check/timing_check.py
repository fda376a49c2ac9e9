"""Whether the rings keep the firing schedule: the rate of their frames, whether rings that share
slots are in step, and whether the readings of their sensors change in their slots.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...formats.firmware.ring_pace import RingPace, ring_paces
from ...objectives.firing.schedule import firing_schedule
from ...objectives.options import FiringOptions
from ...objectives.scene import Scene
from ..rings.protocol import Frame, Status
from ..sensing.frame_comb import FrameComb, cycle_of, frame_comb, within_slot
from .models import TimingModel
from .options import CheckOptions

STEP_S = 0.02
"""Largest difference of two rings that counts as in step, s: a serial adapter may hold its data
back by 16 ms, and what all frames of a ring have alike cannot be told from their time."""
_SHARE, _LATE_S = 0.01, 0.002  # of a cycle, and s, by which one may differ from the schedule
_LONGEST_S = 10.0  # of the frames that are compared: the last ones
_OUTSIDE = 0.2  # share of a sensor's new readings that may come outside of its slot
_FEWEST = 5  # new readings of a sensor that is judged
_REPEATS = 0.5  # share of the cycles that bring a new reading, at least
_SCATTER_M = 0.003  # scatter from which a reading is seldom the same as the one before


def scheduled_paces(setup: Setup, scene: Scene, options: CheckOptions) -> tuple[RingPace, ...]:
    """Return the pace of each ring by the firing schedule, that of ``export --scheduled``; none
    without ``--scheduled``.

    Raises:
        UserError: if no firmware keeps it, or if no ring can be late that shall be.
    """
    if not options.scheduled:
        return ()
    try:
        schedule = firing_schedule("", setup, scene, FiringOptions())
        paces = ring_paces(setup, scene, schedule)
    except ValueError as error:
        raise UserError(f"--scheduled: {error}") from error
    shared = any(pace.slots is not None and pace.slots.shared for pace in paces)
    if options.injected == "late" and not shared:
        raise UserError("--injected late: no two rings share slots that one could lose")
    return paces


@dataclass(frozen=True)
class RingFrames:
    """Frames of a ring while the robot stood still, in order."""

    time: Float[np.ndarray, " n"]
    """When they were sent, s, about 0 in the middle of all rings' frames."""
    number: Int[np.ndarray, " n"]
    """Their numbers, ascending."""
    distance: Float[np.ndarray, "n k"]
    """Readings, m; nan without one."""
    status: Int[np.ndarray, "n k"]
    """Their statuses."""
    clocked: bool
    """Whether they have the time of the ring's own clock."""

    @staticmethod
    def of(frames: Sequence[Frame], times: Float[np.ndarray, " n"]) -> "RingFrames":
        """Return the frames since the last restart, of at most ``_LONGEST_S``.

        Args:
            frames: of a ring.
            times: when they were sent, s.
        """
        last = max((frame.era for frame in frames), default=0)
        recent = times > max(times, default=0.0) - _LONGEST_S
        kept = [i for i, frame in enumerate(frames) if frame.era == last and recent[i]]
        mine = [frames[i] for i in kept]
        steps = np.diff([frame.sequence for frame in mine], prepend=[f.sequence for f in mine[:1]])
        shape = (len(mine), len(mine[0].distance) if mine else 0)
        return RingFrames(
            times[kept],
            np.cumsum(steps % (1 << 16)).astype(int),
            np.array([frame.distance for frame in mine]).reshape(shape),
            np.array([frame.status for frame in mine], int).reshape(shape),
            bool(mine) and not any(np.isnan(frame.clock) for frame in mine),
        )


def timing_check(
    setup: Setup, paces: Sequence[RingPace], rings: Sequence[RingFrames]
) -> list[TimingModel]:
    """Compare the frames of each ring with its pace.

    Args:
        setup: the rings.
        paces: the pace of each.
        rings: the frames of each.
    """
    found = [
        cycle_of(one.time, one.number, pace.frames) for one, pace in zip(rings, paces, strict=True)
    ]
    combs = {
        i: frame_comb(rings[i].time, cycle, paces[i])
        for i, cycle in enumerate(found)
        if paces[i].slots and cycle is not None and rings[i].clocked
        if _keeps_rate(cycle, paces[i])
    }
    late = _out_of_step(paces, combs)
    return [_judged(setup, i, paces[i], rings[i], found[i], combs, late) for i in range(len(rings))]


def _keeps_rate(cycle: float, pace: RingPace) -> bool:
    return abs(cycle - pace.cycle_s) <= _SHARE * pace.cycle_s + _LATE_S


def _out_of_step(
    paces: Sequence[RingPace], combs: Mapping[int, FrameComb]
) -> Mapping[int, tuple[float, int]]:
    """Return, of each ring that shares slots, how much later its cycles begin than those of the
    ring with which most of its group are in step, s, and that ring; of several the first.
    """
    late = dict[int, tuple[float, int]]()
    groups = {p.slots.rings for p in paces if p.slots is not None and p.slots.shared}
    for group in groups:
        mine = [ring for ring in group if ring in combs]
        behind = {a: {b: combs[b].behind(combs[a]) for b in mine} for a in mine}
        agree = {a: sum(abs(by) <= STEP_S for by in each.values()) for a, each in behind.items()}
        if mine:
            first = max(mine, key=lambda ring: agree[ring])
            late |= {ring: (by, first) for ring, by in behind[first].items()}
    return late


def _judged(
    setup: Setup,
    i: int,
    pace: RingPace,
    ring: RingFrames,
    cycle: float | None,
    combs: Mapping[int, FrameComb],
    late: Mapping[int, tuple[float, int]],
) -> TimingModel:
    """Describe what a ring keeps of its pace."""
    lines, open_, name = list[str](), list[str](), setup.group_name(i)
    rate = None if cycle is None else pace.frames / cycle
    by, reference = late.get(i, (None, None))
    outside, repeating, seen = list[int](), list[int](), 0
    if rate is None:
        open_.append(f"{name}: too few frames to compare with the firing schedule")
    elif i in combs:
        outside, repeating, seen = _sensors(pace, ring, combs[i])
    elif pace.slots is not None and not ring.clocked:
        open_.append(f"{name}: its frames have no clock: only their rate was compared")
    if rate is not None and cycle is not None and not _keeps_rate(cycle, pace):
        slow = "slow" if rate < pace.rate_hz else "fast"
        wanted = f"the firing schedule wants {pace.rate_hz:.2f}"
        lines.append(f"{name} is too {slow}: {rate:.2f} frames a second, {wanted}")
    if by is not None and reference is not None and abs(by) > STEP_S:
        when = f"{1000 * abs(by):.0f} ms {'after' if by > 0 else 'before'}"
        lines.append(
            f"{name} is out of step: its cycles begin {when} those of"
            f" {setup.group_name(reference)}, allowed: {1000 * STEP_S:.0f} ms"
        )
    for sensors, text in (
        (outside, "range outside of their slots"),
        (repeating, "have no new reading in most of their slots"),
    ):
        if sensors:
            names = ", ".join(map(str, sensors))
            lines.append(f"{name}: sensors {names} {text}")
    return TimingModel(
        ring=i,
        cycle_ms=1000 * pace.cycle_s,
        wanted_hz=round(pace.rate_hz, 3),
        found_hz=None if rate is None else round(rate, 3),
        late_ms=None if by is None else round(1000 * by, 1),
        reference=reference,
        seen=seen,
        outside=outside,
        repeating=repeating,
        faults=lines,
        open=open_,
    )


def _sensors(pace: RingPace, ring: RingFrames, comb: FrameComb) -> tuple[list[int], list[int], int]:
    """Return the sensors whose readings change outside of their slots, those whose readings change
    in too few cycles, and the number of those whose slots were seen at all.
    """
    distance = np.where(ring.status == Status.VALID, ring.distance, np.nan)
    known = np.isfinite(distance[1:]) & np.isfinite(distance[:-1])
    at, sensor = np.nonzero(known & (distance[1:] != distance[:-1]))
    inside = within_slot(ring.time[at], ring.time[at + 1], sensor, pace, comb)
    count = distance.shape[1]
    changes = np.bincount(sensor, minlength=count)
    out = np.bincount(sensor[~inside], minlength=count)
    outside = (changes >= _FEWEST) & (out > _OUTSIDE * changes)
    cycles = min(comb.cycles, float(len(ring.time)))
    with np.errstate(invalid="ignore"):
        scatter = np.nanstd(np.where(known.any(axis=0), distance, 0.0), axis=0)
    always = np.isfinite(distance).all(axis=0) & (scatter > _SCATTER_M) & (changes > 0)
    repeating = always & (changes < _REPEATS * cycles) & (cycles >= 2 * _FEWEST) & ~outside
    return (
        np.flatnonzero(outside).tolist(),
        np.flatnonzero(repeating).tolist(),
        int((changes >= _FEWEST).sum()),
    )
