"""Frames of a ring, from the readings of its sensors, which a file holds one by one."""

import numpy as np

from ...coverage.definitions.errors import shown
from ..rings.line_monitor import SILENT, Event, Happened
from ..rings.protocol import ABSENT, Counts, Frame
from ..rings.zones import Zones
from .messages import RangeMessage, refuse

_MOST = 500_000  # frames
_PERIODS = 3.0  # median periods; a longer gap between two frames is reported


class RingTrack:
    """Collects the frames of ring ``number`` with ``count`` sensors.

    A frame holds at most one reading of each sensor: it ends when a sensor reads again. A sensor
    without a reading in a frame is absent from it, so sensors may have different rates.
    """

    def __init__(self, number: int, count: int) -> None:
        self._number, self._count = number, count
        self.frames, self.counts = list[Frame](), Counts()
        self.topics: dict[str, None] = {}
        self._last, self._clocks = -np.inf, dict[int, float]()
        self._restarts = list[float]()
        self._begin()

    def _begin(self) -> None:
        self._distance = np.full(self._count, np.nan)
        self._status = np.full(self._count, ABSENT, np.uint8)
        self._zones = dict[int, tuple[np.ndarray, np.ndarray]]()  # distance and status (r, c)

    def take(self, name: str, sensor: int, message: RangeMessage) -> None:
        """Add a reading of ``sensor`` in file ``name``; raise UserError if times run back."""
        if message.time < self._last:
            where = f"{shown(message.topic)} ({shown(message.frame)}) at {message.time:.3f} s"
            found = f"a time {self._last - message.time:.3g} s before the last of its ring"
            raise refuse(name, where, found, "times in order")
        self.topics[message.topic] = None
        if self._status[sensor] != ABSENT:
            self._end(name)
        if message.clock < self._clocks.get(sensor, -np.inf):
            self.counts.restarts += 1
            self._restarts.append(message.time)
        self._clocks[sensor] = message.clock
        self._last, self._clock = message.time, message.clock
        self._distance[sensor], self._status[sensor] = message.distance, message.status
        if message.zones is not None and message.zone_status is not None:
            self._zones[sensor] = message.zones, message.zone_status

    def _end(self, name: str) -> None:
        """Store the present frame and begin the next."""
        if len(self.frames) >= _MOST:
            raise refuse(name, f"ring {self._number}", f"more than {_MOST} frames", "fewer")
        self.counts.frames += 1
        values, number = (self._distance, self._status), len(self.frames)
        zones = self._grids()
        self.frames.append(Frame(self._last, self._clock, number, *values, zones=zones))
        self._begin()

    def _grids(self) -> Zones | None:
        """Return the zones of the present frame; those of another shape than the first are left
        out.
        """
        if not self._zones:
            return None
        shape = next(iter(self._zones.values()))[0].shape
        distance = np.full((self._count, *shape), np.nan)
        status = np.full(distance.shape, ABSENT, np.uint8)
        for sensor, (grid, state) in self._zones.items():
            if grid.shape == shape:
                distance[sensor], status[sensor] = grid, state
        mm = np.rint(1000 * np.nan_to_num(distance)).astype(np.uint16)
        return Zones(mm[..., None], status[..., None])

    def close(self, name: str) -> None:
        """Store the last frame."""
        if (self._status != ABSENT).any():
            self._end(name)

    def events(self) -> list[Event]:
        """Return restarts of its clock, and one event for all gaps."""
        events = [Event(self._number, Happened.RESTARTED, time) for time in self._restarts[:1]]
        time = np.array([frame.time for frame in self.frames])
        between = np.diff(time)
        if not len(between):
            return events
        gaps = between > max(SILENT, _PERIODS * float(np.median(between)))
        if gaps.any():
            first = float(time[int(gaps.argmax())])
            detail = f"{gaps.sum()} gaps, the longest {between.max():.2f} s"
            events.append(Event(self._number, Happened.SILENT, first, detail))
        return events
