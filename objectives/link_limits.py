"""Limits of the links of a check: how old its data may be, and how long its programs may be silent,
before the robot is stopped.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class LinkLimits:
    """Limits of the links to the robot and to its rings. All of them are times until a stop."""

    rate: float = 125.0
    """States of the robot per second; every controller has 125."""
    state_stale: float = 0.08
    """Age of the robot's newest state, and delay of any state, beyond which the link ends, s."""
    ring_silent: float = 0.25
    """Time without a frame of a ring, after which it counts as silent, s. Rings send at least ten
    frames a second."""
    ring_late: float = 0.1
    """Delay of a frame, beyond which it is not used, s."""
    sign_of_life: float = 0.2
    """Time without a sign of life of the check, or of the process that moves the robot, after which
    the other of them stops the robot, s."""
    watchdog: float = 0.2
    """Time without a sign of life of the process that moves the robot, after which the robot ends
    its program, s."""

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
