"""Conditions of a simulation of approaches: its options, and the motion with its separation
distances."""

from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from ._arguments import number, whole
from ._errors import InputError, input_errors
from ._trajectory import Trajectory
from .coverage.electronics.electronics import readings_hz
from .coverage.occlusion.occlusion_mode import Occlusion
from .coverage.rings.ring import Setup
from .coverage.robots.separation_distance import Safety
from .objectives.scene import CoreScene
from .simulation.detection import Timing
from .simulation.motion_samples import Moments, moments_of_record, moments_of_scene

_ASSUMED_HZ = 20.0  # where no rate is known
_MOST_APPROACHES, _MOST_DIRECTIONS, _MOST_HZ, _MOST_LATENCY = 100_000, 360, 10_000, 5


@dataclass(frozen=True)
class SafetyOptions:
    """How approaches are drawn and reported."""

    approaches: int
    """Number of approaches."""
    directions: int
    """Number of sectors with a share of their own."""
    rate: float | None
    """Readings of each sensor, Hz; None for those of its ring's bus, or the catalogue's."""
    latency: float
    """Time from a reading to the report, s."""
    occlusion: Occlusion
    """Model of occlusion."""
    seed: int
    """Random seed."""

    def check(self) -> None:
        """Check the options.

        Raises:
            InputError: for a value out of range.
        """
        whole("approaches", self.approaches, 1, _MOST_APPROACHES)
        whole("directions", self.directions, 1, _MOST_DIRECTIONS)
        whole("seed", self.seed, 0)
        if self.rate is not None:
            number("rate", self.rate, "Hz, above 0")
            if not 0 < self.rate <= _MOST_HZ:
                raise InputError(f"found {self.rate:g}, allowed: Hz, 0 to {_MOST_HZ:,}", "rate")
        number("latency", self.latency, "s, 0 or more")
        if not 0 <= self.latency <= _MOST_LATENCY:
            raise InputError(f"found {self.latency:g}, allowed: s, 0 to {_MOST_LATENCY}", "latency")
        if self.occlusion not in get_args(Occlusion):
            allowed = ", ".join(get_args(Occlusion))
            raise InputError(f"found {self.occlusion!r}, allowed: {allowed}", "occlusion")


@dataclass(frozen=True)
class SafetyMotion:
    """The moments of the motion with two separation distances."""

    moments: Moments
    """Moments whose distances exclude period and latency, which the simulation accounts for."""
    full: Moments
    """The same moments with the full distances."""
    safety: Safety
    """Terms of the full distances."""
    timing: Timing
    """Period and latency of each sensor."""
    assumed: bool
    """Whether a rate of readings is assumed."""


def motion_of(
    setup: Setup, scene: CoreScene, trajectory: Trajectory | None, options: SafetyOptions
) -> SafetyMotion:
    """Return the moments of a motion, and the timing of the sensors.

    The simulation accounts for period and latency; the rest of the reaction time T_r stays in S.

    Raises:
        InputError: for a motion that does not fit the robot, or a robot without a stopping time.
    """
    rates = [
        options.rate or readings_hz(scene.electronics, r.sensor, r.count, r.radius)
        for r in setup.groups
    ]
    period = np.repeat(
        [1 / (rate or _ASSUMED_HZ) for rate in rates], [r.count for r in setup.groups]
    )
    timing = Timing(period, options.latency)
    late = float(timing.spent.max())
    whole_safety = replace(scene.safety, reaction=max(scene.safety.reaction, late))
    left = replace(whole_safety, reaction=whole_safety.reaction - late)
    record = None if trajectory is None else trajectory.record(scene.robot)
    with input_errors("safety"):
        moments, full = (
            moments_of_scene(scene, one)
            if record is None
            else moments_of_record(scene.robot, record, one)
            for one in (left, whole_safety)
        )
    return SafetyMotion(moments, full, whole_safety, timing, any(rate is None for rate in rates))
