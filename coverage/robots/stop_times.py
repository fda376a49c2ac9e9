"""Measured stops of a user's own robot, and the conditions under which they were measured.

How long a robot takes to stop depends on its extension, load and speed. ISO 13855:2024 expects at
least ten measurements under each condition (read in secondary sources). The largest of all measured
times counts. None is interpolated, so a condition that was not measured never gets a shorter time
than a measured one.
"""

from collections.abc import Sequence
from itertools import groupby
from typing import Annotated

from pydantic import Field

from ..definitions.definition import definition, refuse
from ..definitions.field_types import Text

LEAST_MEASUREMENTS = 10
"""Measurements that ISO 13855:2024 expects under each condition."""
_Percent = Annotated[float, Field(ge=0, le=100)]
_Condition = tuple[str, float, float, float]


@definition(kw_only=True)
class StopTime:
    """One measured stop of a joint, from the command to standstill, at a share of the robot's
    largest extension, load and speed.

    Example:
        >>> import place_rings as pr
        >>> stop = pr.StopTime(
        ...     joint="shoulder_pan",
        ...     extension_percent=100,
        ...     load_percent=100,
        ...     speed_percent=66,
        ...     stop_s=0.41,
        ...     stop_rad=0.31,
        ...     repeat=1,
        ... )
        >>> pr.Safety(stop_times=[stop]).stop_times[0].stop_s
        0.41
    """

    joint: Annotated[Text, Field(min_length=1)]
    """Name of the joint that moved."""
    extension_percent: _Percent
    """Extension of the arm, percent of the largest."""
    load_percent: _Percent
    """Load, percent of the largest."""
    speed_percent: Annotated[float, Field(gt=0, le=100)]
    """Speed at the command to stop, percent of the largest."""
    stop_s: Annotated[float, Field(gt=0, le=10)]
    """Time from the command to standstill, s."""
    stop_rad: Annotated[float, Field(ge=0, le=100)] | None = None
    """Angle that the joint turned meanwhile, rad."""
    stop_m: Annotated[float, Field(ge=0, le=100)] | None = None
    """Distance that the fastest point moved meanwhile, m."""
    repeat: Annotated[int, Field(ge=1, le=1_000_000)]
    """Number of the measurement under this condition, from 1."""

    def __post_init__(self) -> None:
        if self.stop_rad is None and self.stop_m is None:
            refuse([(("stop_rad",), None, "stop_rad, rad, or stop_m, m")])

    @property
    def condition(self) -> _Condition:
        """Joint, extension, load and speed."""
        return self.joint, self.extension_percent, self.load_percent, self.speed_percent


@definition(kw_only=True)
class StopCondition:
    """The measured stops of a joint under one condition."""

    joint: Text
    """Name of the joint."""
    extension_percent: float
    """Extension, percent."""
    load_percent: float
    """Load, percent."""
    speed_percent: float
    """Speed, percent."""
    measurements: int
    """Number of measurements."""
    enough: bool
    """Whether there are at least ten measurements."""
    mean_s: float
    """Mean stopping time, s."""
    largest_s: float
    """Largest stopping time, s."""
    largest_rad: float | None = None
    """Largest angle, rad."""
    largest_m: float | None = None
    """Largest distance, m."""


def repeated(stops: Sequence[StopTime]) -> int | None:
    """Return the index of the first stop whose condition and number an earlier one has; None if
    there is none."""
    seen = set[tuple[_Condition, int]]()
    for i, stop in enumerate(stops):
        if (key := (stop.condition, stop.repeat)) in seen:
            return i
        seen.add(key)
    return None


def by_condition(stops: Sequence[StopTime]) -> tuple[StopCondition, ...]:
    """Return the measured stops summed up by condition, in the order of joint, extension, load and
    speed."""
    ordered = sorted(stops, key=lambda stop: stop.condition)
    return tuple(_summed(list(same)) for _, same in groupby(ordered, lambda stop: stop.condition))


def _summed(same: list[StopTime]) -> StopCondition:
    joint, extension, load, speed = same[0].condition
    times = [stop.stop_s for stop in same]
    return StopCondition(
        joint=joint,
        extension_percent=extension,
        load_percent=load,
        speed_percent=speed,
        measurements=len(same),
        enough=len(same) >= LEAST_MEASUREMENTS,
        mean_s=sum(times) / len(times),
        largest_s=max(times),
        largest_rad=max((s.stop_rad for s in same if s.stop_rad is not None), default=None),
        largest_m=max((s.stop_m for s in same if s.stop_m is not None), default=None),
    )
