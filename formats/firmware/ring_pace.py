"""Pace of a ring: when its exported firmware sends frames, and when its sensors range."""

from typing import Annotated

from pydantic import Field

from ...coverage.definitions.definition import definition
from ...coverage.rings.ring import Setup
from ...objectives.firing.schedule import FiringSchedule
from ...objectives.scene import Scene
from .ring_slots import RingSlots
from .wiring import plan_setup


@definition(kw_only=True)
class RingPace:
    """When a ring sends frames. One that fires in slots sends its first at the beginning of each
    cycle, the others at equal times after it; its cycle is that of its group."""

    frame_ms: Annotated[int, Field(ge=1, le=10_000)]
    """Time between frames, ms; in a cycle, if it has several."""
    slots: RingSlots | None = None
    """Its slots; none if all its sensors range at once."""

    @property
    def frames(self) -> int:
        """Frames in a cycle."""
        return 1 if self.slots is None else self.slots.frames

    @property
    def cycle_s(self) -> float:
        """Time between two readings of a sensor, s."""
        return self.frame_ms / 1000 if self.slots is None else self.slots.cycle_us / 1e6

    @property
    def frame_s(self) -> float:
        """Time between frames in a cycle, s."""
        return self.frame_ms / 1000

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self.frames / self.cycle_s

    @property
    def oldest_s(self) -> float:
        """Largest age of a reading when the next frame comes, s."""
        return self.cycle_s + (0.0 if self.slots is None else self.frame_s)


def ring_paces(setup: Setup, scene: Scene, schedule: FiringSchedule) -> tuple[RingPace, ...]:
    """Return the pace of each ring and single sensor, with the firmware that ``export --to
    firmware --scheduled`` writes.

    Args:
        setup: the sensors.
        scene: with its electronics.
        schedule: their firing schedule.

    Raises:
        ValueError: if no firmware reads one; one line.
    """
    wirings = plan_setup(setup, scene.electronics, schedule)
    return tuple(RingPace(frame_ms=w.period_ms, slots=w.slots) for w in wirings)
