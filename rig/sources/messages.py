"""What a rig's file tells, message by message, whatever the file's format."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Integer

from ...coverage.definitions.errors import UserError, shown
from ..rings.protocol import MOST_MM, Status

FARTHEST = MOST_MM / 1000  # m, of a distance
_LATEST = 1e11  # s since 1970


@dataclass(frozen=True)
class JointMessage:
    """Joint angles of a robot, or of a part of it."""

    topic: str
    """Topic; in CSV the name of the file."""
    time: float
    """When the file's recorder received it, s."""
    clock: float
    """Time stamp by the sender's clock, s; nan if it has none."""
    names: tuple[str, ...]
    """Names of the joints."""
    position: Float[np.ndarray, " n"]
    """Angles, rad."""


@dataclass(frozen=True)
class RangeMessage:
    """One reading of one sensor."""

    topic: str
    """Topic; in CSV the name of the file."""
    frame: str
    """Name of the sensor's frame."""
    time: float
    """When the file's recorder received it, s."""
    clock: float
    """Time stamp by the sender's clock, s; nan if it has none."""
    distance: float
    """Distance, m; nan where there is none."""
    status: Status
    """Status of the distance."""
    zones: Float[np.ndarray, "r c"] | None = None
    """Distance in each zone, m, nan where there is none; None for a sensor of one zone."""
    zone_status: Integer[np.ndarray, "r c"] | None = None
    """Status of each zone; None for a sensor of one zone."""


@dataclass(frozen=True)
class StepMessage:
    """Begin or end of a step of the check."""

    topic: str
    """Topic; in CSV the name of the file."""
    time: float
    """When the file's recorder received it, s."""
    text: str
    """Such as ``mount 3`` or ``end``."""


Message = JointMessage | RangeMessage | StepMessage


@dataclass(frozen=True, eq=False)
class RigFile:
    """A file of a rig."""

    name: str
    """Name of the file, for messages."""
    messages: Callable[[], Iterator[Message]]
    """Yields the messages in the order of the file; raises UserError at the first that is
    damaged."""


def refuse(name: str, where: str, found: str, wanted: str) -> UserError:
    """Return an error that names the file, the topic or line, what it holds and what it must."""
    return UserError(f"{name}: {where}: found {found}, wanted: {wanted}")


def listed(names: Iterable[str], most: int) -> str:
    """Return the first ``most`` names, and whether there are more, as one short text."""
    each = list(names)
    return ", ".join(name[:100] for name in each[:most]) + ", …" * (len(each) > most) or "none"


def checked_time(name: str, where: str, time: float) -> float:
    """Return ``time``, s; raise UserError if it is none."""
    if not 0 <= time < _LATEST:
        raise refuse(name, where, f"the time {shown(time)}", f"0 to {_LATEST:g} s")
    return time


def ranged(distance: float, low: float, high: float) -> tuple[float, Status]:
    """Return distance and status of a reading as ``sensor_msgs/Range`` states it (REP 117).

    Args:
        distance: m; infinite without a target, minus infinity if too near, nan for a failure.
        low: the least distance that the sensor measures, m.
        high: the largest, m; 0 or less if it is not stated.

    Returns:
        The distance, m, nan where there is none, and its status.
    """
    if np.isnan(distance) or (np.isfinite(distance) and distance < 0):
        return np.nan, Status.FAILED
    most = min(high, FARTHEST) if high > 0 else FARTHEST
    if distance > most:
        return np.nan, Status.NO_TARGET
    if distance < low:
        return max(distance, 0.0), Status.WEAK
    return distance, Status.VALID
