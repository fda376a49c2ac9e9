"""Limits of the links of a check: how old its data may be, and how long its programs may be silent,
before the robot is stopped.
"""

from typing import Annotated

from ..coverage.definitions.definition import Fault, definition, refuse
from ..coverage.definitions.units import Key

_FEWEST = 3  # states within state_stale: a single one that is late or lost is no fault


@definition
class LinkLimits:
    """Limits of a check's links to the robot and its rings; times until the robot is stopped. They
    are no safety function."""

    rate: Annotated[float, Key("rate_hz", ge=50, le=500)] = 125.0
    """States of the robot per second, Hz; every controller has 125."""
    state_stale: Annotated[float, Key("state_stale_s", ge=0.01, le=0.5)] = 0.08
    """Age or delay of a state of the robot that stops it, s."""
    ring_silent: Annotated[float, Key("ring_silent_s", ge=0.1, le=1)] = 0.25
    """Time without a frame of a ring that stops the robot, s; rings send at least ten a second."""
    ring_late: Annotated[float, Key("ring_late_s", ge=0.01, le=0.5)] = 0.1
    """Delay beyond which a frame of a ring is not used, s."""
    sign_of_life: Annotated[float, Key("sign_of_life_s", ge=0.05, le=0.5)] = 0.2
    """Time for which the check's programs may be silent during a motion, s."""
    watchdog: Annotated[float, Key("watchdog_s", ge=0.05, le=0.5)] = 0.2
    """Time without a sign of life after which the robot ends its program, s."""

    def __post_init__(self) -> None:
        """Refuse limits that would end every check: no two states and no two frames in time."""
        least = _FEWEST / self.rate
        faults: list[Fault] = []
        if self.state_stale < least:
            allowed = f"at least {_FEWEST} states at rate_hz = {self.rate:g}: {least:.3g} s"
            faults.append((("state_stale_s",), self.state_stale, allowed))
        if self.ring_late > self.ring_silent:
            allowed = f"at most ring_silent_s = {self.ring_silent:g}"
            faults.append((("ring_late_s",), self.ring_late, allowed))
        refuse(faults)

    @property
    def oldest_reading(self) -> float:
        """Largest age of a reading that the stop conditions use: it arrives as late as allowed, and
        no newer frame replaces it until the ring counts as silent, s."""
        return self.ring_late + self.ring_silent

    def longer_than(self, other: "LinkLimits") -> bool:
        """Whether a time until a stop is longer than that of ``other``."""
        return any(
            getattr(self, name) > getattr(other, name)
            for name in ("state_stale", "ring_silent", "ring_late", "sign_of_life", "watchdog")
        )


USUAL_LIMITS = LinkLimits()
"""The limits of a scene that states none."""
