"""When each sensor measures: its period, and the moment of its first measurement."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...coverage.electronics.frame_times import frame_times
from ...coverage.rings.ring import Setup
from ...objectives.firing.schedule import FiringSchedule
from ...objectives.scene import Scene

_SOON = 1e-6  # periods, rounding of a moment


class FrameClock(NamedTuple):
    """Clocks of K sensors; a frame arrives one period after its measurement."""

    period: Float[np.ndarray, " K"]
    """Time between two measurements, s."""
    first: Float[np.ndarray, " K"]
    """Moment of a measurement, s."""

    def number(self, now: float | Float[np.ndarray, " K"]) -> Int[np.ndarray, " K"]:
        """Return the number of the latest measurement of each sensor up to a moment, s."""
        number: np.ndarray = np.floor((now - self.first) / self.period + _SOON).astype(int)
        return number

    def moment(self, number: Int[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
        """Return when measurements are made, s."""
        moment: np.ndarray = self.first + number * self.period
        return moment

    def arrived(self, moment: Float[np.ndarray, " K"], now: float) -> np.ndarray:
        """Return which measurements (K,) have arrived by now."""
        arrived: np.ndarray = moment + self.period <= now + _SOON * self.period
        return arrived


def frame_clock(scene: Scene, setup: Setup, schedule: FiringSchedule | None = None) -> FrameClock:
    """Return the clocks of a setup: at the rates of its electronics and of the catalogue, all at
    once; or in the slots of a schedule.

    Args:
        scene: the scene, with its electronics.
        setup: all sensors, with those of the cell at the end.
        schedule: the slots of its first sensors; None: all fire at once.

    Raises:
        ValueError: if the schedule is one of other sensors.
    """
    e = scene.electronics
    rates = [frame_times(e, g.sensor, g.count, g.radius).free_hz for g in setup.groups]
    period, first = 1 / np.array(rates)[setup.ring_of_sensor], np.zeros(setup.sensors)
    number = {label: k for k, label in enumerate(setup.labels)}
    for group in () if schedule is None else schedule.groups:
        for slot in group.slots:
            for ring, sensor in slot.sensors:
                if (k := number.get((ring, sensor))) is None:
                    raise ValueError(f"found sensor {sensor} of ring {ring}, which the setup lacks")
                period[k], first[k] = group.period_s, slot.start_s
    return FrameClock(period, first)
