"""Who fires when: the pairs of sensors that may disturb each other, their slots, and the rates.

Rings whose sensors may disturb those of another ring share the slots of one group, which need a
common clock: one controller, or a line for synchronisation. A ring of which no sensor may disturb
another fires all its sensors at once, at the rate of its bus. Otherwise each sensor of the group
fires once in the sum of its slots. A slot counts a guard time, ranging and transfer one after the
other; the start commands are in the transferred bytes. What a sensor needs beyond that to start
ranging at a command is not known, and not counted.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated

import numpy as np
from jaxtyping import Int
from pydantic import Field
from scipy.sparse.csgraph import connected_components

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Items, Pair
from ...coverage.definitions.records import FileRecord
from ...coverage.electronics.frame_times import FrameTimes, frame_times
from ...coverage.rings.ring import Setup
from ..options import FiringOptions
from ..scene import Scene
from .interference import Interference, interference
from .slots import EXACT_S, GUARD_S, FiringProblem, slots

_ROUNDING = 1e-9  # Hz


@definition(kw_only=True)
class DisturbingPair:
    """Two sensors that may disturb each other, and at how many poses; a pose counts under the first
    way that applies."""

    ring: int
    """Ring of the first sensor; single sensors follow the rings."""
    sensor: int
    """Number of the first sensor on its ring."""
    other_ring: int
    """Ring of the second sensor."""
    other_sensor: int
    """Number of the second sensor on its ring."""
    direct: int
    """Poses at which one lights the other's window."""
    overlap: int
    """Poses at which their beams overlap."""
    reflection: int
    """Poses at which they meet on a body."""


@definition(kw_only=True)
class FiringSlot:
    """Sensors that fire together."""

    start_s: float
    """Start from the beginning of the period, s."""
    seconds: float
    """Length, s."""
    sensors: Items[Pair[int]]
    """Ring and number of each sensor."""


@definition(kw_only=True)
class FiringGroup:
    """Rings that share slots by a common clock."""

    rings: Items[int]
    """Numbers of the rings."""
    period_s: float
    """Sum of its slots, s."""
    bound_s: float
    """Proven lower bound of the period of any slots, s."""
    slots: Items[FiringSlot]
    """Its slots in order."""


@definition(kw_only=True)
class RingRate(FrameTimes):
    """The rate of a ring, and its times."""

    ring: int
    """Number of the ring; single sensors follow the rings."""
    link: str
    """Link of the ring."""
    sensors: int
    """Number of its sensors."""
    group: int
    """Number of its group."""
    slots: int
    """Number of slots in which its sensors fire."""
    rate_hz: float
    """Rate of each of its sensors, Hz."""
    holds: bool | None = None
    """Whether it keeps the requested rate; none without one."""


@definition(kw_only=True)
class AffordableSensors:
    """The most sensors that keep a rate, with all rings scaled down evenly."""

    sensors: int
    """Number of sensors; 0: a single one on each ring does not keep it either."""
    counts: Items[int]
    """Number of sensors on each ring."""


@definition(kw_only=True)
class FiringSchedule(FileRecord):
    """Output of ``schedule --json``: which sensors may disturb each other, slots in which no two of
    them fire together, and the rates that follow."""

    setup: str
    """Name or file of the setup."""
    sensors: int
    """Number of sensors."""
    poses: int
    """Number of poses."""
    reach: str
    """Ways to disturb each other that count."""
    pairs: Items[DisturbingPair]
    """Pairs that may disturb each other at some pose."""
    unlike: int = 0
    """Number of pairs that do not, as their wavelengths differ or as one is immune."""
    groups: Items[FiringGroup]
    """Groups of rings with their slots."""
    rings: Items[RingRate]
    """Rings with their rates."""
    period_s: float
    """Longest period of a sensor, s."""
    rate_hz: float
    """Lowest rate of a sensor, Hz."""
    wanted_hz: float | None = None
    """Requested rate, Hz."""
    affordable: AffordableSensors | None = None
    """The most sensors that keep the requested rate."""
    seconds: Annotated[float, Field(ge=0)]
    """Wall-clock time, s."""


def firing_schedule(
    name: str,
    setup: Setup,
    scene: Scene,
    options: FiringOptions,
    tell: Callable[[], None] = lambda: None,
) -> FiringSchedule:
    """Return the pairs, the slots and the rates of a setup.

    Args:
        name: name of the setup.
        setup: the sensors.
        scene: the scene, with its poses, bodies and electronics.
        options: ways that count, and the requested rate.
        tell: is called after each pose of the setup itself.
    """
    began, wanted = time.perf_counter(), options.rate
    meetings = interference(scene, setup, options.reach, tell)
    groups, rings = _timed(setup, scene, meetings, exact=True)
    if wanted is not None:
        rings = tuple(replace(r, holds=_holds(r, wanted)) for r in rings)
    rate = min(r.rate_hz for r in rings)
    label = setup.labels
    pairs = (
        DisturbingPair(
            ring=label[i][0],
            sensor=label[i][1],
            other_ring=label[j][0],
            other_sensor=label[j][1],
            direct=int(count[0]),
            overlap=int(count[1]),
            reflection=int(count[2]),
        )
        for (i, j), count in zip(meetings.pairs, meetings.poses, strict=True)
    )
    return FiringSchedule(
        setup=name,
        sensors=setup.sensors,
        poses=len(scene.poses),
        reach=options.reach,
        pairs=tuple(pairs),
        unlike=meetings.unlike,
        groups=groups,
        rings=rings,
        period_s=1 / rate,
        rate_hz=rate,
        wanted_hz=wanted,
        affordable=None if wanted is None else _affordable(setup, scene, options, rings),
        seconds=time.perf_counter() - began,
    )


def _holds(ring: RingRate, wanted: float) -> bool:
    return ring.rate_hz >= wanted - _ROUNDING


def _timed(
    setup: Setup, scene: Scene, meetings: Interference, exact: bool
) -> tuple[tuple[FiringGroup, ...], tuple[RingRate, ...]]:
    """Return the groups with their slots, and the rings with their rates."""
    ring = setup.ring_of_sensor
    times = [frame_times(scene.electronics, g.sensor, g.count, g.radius) for g in setup.groups]
    conflicts = meetings.conflicts(setup.sensors)
    between = np.zeros((len(times), len(times)), bool)
    between[tuple(ring[meetings.pairs].T)] = True
    count, group_of = connected_components(between, directed=False)
    ranging = np.array([t.ranging_s + GUARD_S for t in times])[ring]
    transfer = np.array([t.transfer_s or 0.0 for t in times])[ring]
    groups, rates = list[FiringGroup](), list[RingRate]()
    for group in range(count):
        own = np.flatnonzero(group_of[ring] == group)
        problem = FiringProblem(conflicts[np.ix_(own, own)], ranging[own], transfer[own], ring[own])
        timed = slots(problem, EXACT_S if exact else 0.0)
        alone, here = len(timed.seconds) == 1, np.unique(ring[own])
        slowest = min(times[r].free_hz for r in here)
        period = 1 / slowest if alone else timed.period
        lengths = np.array([period]) if alone else timed.seconds
        groups.append(
            FiringGroup(
                rings=tuple(here.tolist()),
                period_s=period,
                bound_s=period if alone else timed.bound,
                slots=_slots(setup, own, timed.slot, lengths),
            )
        )
        rates += [
            RingRate(
                **vars(times[r]),
                ring=int(r),
                link=setup.groups[r].link,
                sensors=setup.groups[r].count,
                group=group,
                slots=len(np.unique(timed.slot[ring[own] == r])),
                rate_hz=min(slowest, 1 / period),
            )
            for r in here
        ]
    return tuple(groups), tuple(sorted(rates, key=lambda r: r.ring))


def _slots(
    setup: Setup,
    own: Int[np.ndarray, " M"],
    slot: Int[np.ndarray, " M"],
    seconds: np.ndarray,
) -> tuple[FiringSlot, ...]:
    starts, label = np.cumsum(seconds) - seconds, setup.labels
    return tuple(
        FiringSlot(
            start_s=float(start),
            seconds=float(length),
            sensors=tuple(label[k] for k in own[slot == s]),
        )
        for s, (start, length) in enumerate(zip(starts, seconds, strict=True))
    )


def _affordable(
    setup: Setup, scene: Scene, options: FiringOptions, rings: tuple[RingRate, ...]
) -> AffordableSensors:
    """Return the most sensors that keep the requested rate, from all of them downward."""
    most = max(group.count for group in setup.groups)
    for part in range(most, 0, -1):
        fewer = Setup(
            tuple(replace(r, count=max(1, r.count * part // most)) for r in setup.rings),
            setup.singles,
        )
        if part < most:
            meetings = interference(scene, fewer, options.reach)
            rings = _timed(fewer, scene, meetings, exact=False)[1]
        if all(_holds(r, options.rate or 0.0) for r in rings):
            counts = tuple(group.count for group in fewer.groups)
            return AffordableSensors(sensors=fewer.sensors, counts=counts)
    return AffordableSensors(sensors=0, counts=())
