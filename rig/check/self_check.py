"""Self check of a rig that stands still: which sensors answer, how often, with which noise, and
which see the robot.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ...simulation.twin.noise import Noise
from ...simulation.twin.zone_grid import zoned
from ..sensing.expected import ROBOT, Expected, expected
from ..sensing.readings import Readings, Stops, at_stops
from ..sensing.zone_state import ZoneState, zone_state
from .models import LookModel

_BODY = 0.05  # m between a robot's body and the capsules that model it
_SURE = 5.0  # standard deviations
_NOISY = 3.0  # times the noise model
_LOST = 0.2  # share of readings that miss an existing target
_GAP = 1.5  # periods


@dataclass(frozen=True)
class SelfCheck:
    """Readings of K sensors at one pose, as wired, ring by ring."""

    setup: Setup
    """The rings as proposed."""
    rings: tuple[LookModel, ...]
    """Frames of each ring."""
    stops: Stops
    """The readings, at one stop."""
    wanted: Expected
    """The expected readings there."""
    noise: Noise
    """Noise model of the sensors."""
    zones: tuple[ZoneState, ...] = ()
    """State of the zones of each ring that sends zones."""

    @property
    def answers(self) -> Float[np.ndarray, " K"]:
        """Share of readings that are not failures."""
        total = np.maximum(self.stops.total[0], 1)
        return np.asarray((self.stops.total[0] - self.stops.failed[0]) / total)

    @property
    def valid(self) -> Float[np.ndarray, " K"]:
        """Share of readings with a target."""
        return np.asarray(self.stops.valid[0] / np.maximum(self.stops.total[0], 1))

    @property
    def silent_zones(self) -> list[str]:
        """Zones that never answer, of sensors that do."""
        return [name for z in self.zones for name in z.named(z.silent, self._name(z.ring))]

    @property
    def blocked_zones(self) -> list[str]:
        """Zones that something right before the sensor blocks."""
        return [name for z in self.zones for name in z.named(z.blocked, self._name(z.ring))]

    def _name(self, group: int) -> str:
        single = group >= len(self.setup.rings)
        return self.setup.group_name(group) if single else str(group)

    @property
    def silent(self) -> Int[np.ndarray, " s"]:
        """Sensors that never answer."""
        return np.flatnonzero(self.answers == 0)

    @property
    def on_robot(self) -> Int[np.ndarray, " s"]:
        """Sensors that are expected to see the robot itself here, and read about that distance."""
        return np.flatnonzero((self.wanted.what[0] == ROBOT) & ~self._off & self._sees)

    @property
    def noisy(self) -> Int[np.ndarray, " s"]:
        """Sensors whose readings scatter more than expected."""
        with np.errstate(invalid="ignore"):
            return np.flatnonzero(self.stops.spread[0] > _NOISY * self._deviation)

    @property
    def lossy(self) -> Int[np.ndarray, " s"]:
        """Sensors that answer and see a target, but often miss it."""
        return np.flatnonzero((self.answers > 0) & (self.valid > 0) & (self.valid < 1 - _LOST))

    @property
    def surprising(self) -> Int[np.ndarray, " s"]:
        """Sensors that differ from the expected reading: a ring is mounted differently, or an
        object is missing from the scene.
        """
        return np.flatnonzero((self.answers > 0) & self._off)

    @property
    def _sees(self) -> Bool[np.ndarray, " K"]:
        return np.asarray(np.isfinite(self.stops.distance[0]))

    @property
    def _deviation(self) -> Float[np.ndarray, " K"]:
        return self.noise.at(np.nan_to_num(self.stops.distance[0]))

    @property
    def _off(self) -> Bool[np.ndarray, " K"]:
        """Which sensors differ from the expected reading."""
        distance, wanted = self.stops.distance[0], self.wanted.distance[0]
        with np.errstate(invalid="ignore"):
            far = np.abs(distance - wanted) > _BODY + _SURE * self._deviation
        return np.asarray(far | (self._sees != np.isfinite(wanted)))

    def named(self, which: Iterable[int]) -> list[str]:
        """Name sensors as ``sensor_names`` does."""
        return sensor_names(self.setup, which)


def sensor_names(setup: Setup, which: Iterable[int]) -> list[str]:
    """Name sensors as ring:sensor, both counted from 0, and single sensors by their names."""
    names, rings = list[str](), len(setup.rings)
    for k in which:
        group, sensor = setup.labels[k]
        names.append(f"{group}:{sensor}" if group < rings else setup.group_name(group))
    return names


def self_check(
    scene: Scene, setup: Setup, readings: Readings, noise: Noise | None = None
) -> SelfCheck:
    """Evaluate readings taken while the robot stood still.

    Raises:
        ValueError: if there is no reading, or one of a sensor that the setup does not have.
    """
    if not len(readings):
        raise ValueError("no reading of any ring; read every ring for some seconds")
    q = np.median(readings.joints, axis=0)[None]
    stops, wanted = at_stops(readings, setup, q), expected(scene, setup, q)
    states = [zone_state(scene, setup, i, readings, q) for i in zoned(setup)]
    rings = tuple(
        _look(i, readings.time[readings.ring == i], stops.of(k)) for i, k in enumerate(setup.slices)
    )
    zones = tuple(state for state in states if state is not None)
    return SelfCheck(setup, rings, stops, wanted, noise or Noise(), zones)


def _look(ring: int, time: Float[np.ndarray, " n"], stops: Stops) -> LookModel:
    """Describe a ring by the times of its readings, s, and by what its sensors read."""
    frames, spread = np.unique(time), stops.spread[0]
    period, known = np.diff(frames), spread[np.isfinite(spread)]
    return LookModel(
        ring=ring,
        frames=len(frames),
        rate_hz=round(float(1 / period.mean()), 3) if len(period) else 0.0,
        gaps=int((period > _GAP * np.median(period)).sum()) if len(period) else 0,
        answering=int((stops.total[0] > stops.failed[0]).sum()),
        scatter_mm=round(1000 * float(np.median(known)), 3) if len(known) else None,
    )
