"""The log of a check as a ROS 2 bag: joint states, transforms, every reading and what happened, for
Foxglove, rerun, RViz, and ``check --joints``."""

import heapq
import math
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...coverage.definitions.errors import UserError
from ...formats.export.mcap_log import fixed_frames, moved_frames
from ...formats.export.placed import PlacedSetup
from ...formats.export.ros2_bag import (
    JOINTS,
    LOG,
    POINTS,
    RANGE,
    STATIC,
    TEXT,
    TRANSFORMS,
    RosBag,
)
from ...formats.ring_status import Status
from ...simulation.twin.ros_topics import beam_angle, range_of, zone_points
from ...simulation.twin.zone_grid import zone_grid
from ..rings.line_monitor import Happened
from ..rings.protocol import ABSENT
from ..session.gathering import Gathered
from ..sources.names import STEPS
from .planned_check import PlannedCheck, ring_names

_PERIOD = 0.05  # s between two messages on /tf
_INFORMATION, _WARNING, _ERROR = 20, 30, 40
_LATEST = 2.0**31  # s since 1970 that a stamp holds


class _Message(NamedTuple):
    """A message of the log."""

    time: float
    """When it was received, s of the check's clock."""
    rank: int
    """Order among messages of one time."""
    topic: str
    kind: str
    message: Any


def write_bag(check: PlannedCheck, gathered: Gathered, start: float, folder: Path) -> list[str]:
    """Write the data of a check as a bag into a new folder below ``folder``.

    Topics: ``/joint_states``; ``/tf`` and ``/tf_static`` with the rings as proposed; for each
    sensor ``/tof_R_K`` (Range) or, with zones, ``/tof_R_K/zones`` (PointCloud2); the steps; and
    ``/rosout`` with warnings and faults. Stamps are the time of measurement by the host's clock.

    Args:
        check: the check.
        gathered: its data.
        start: s since 1970 at the time 0 of the check's clock.
        folder: output folder.

    Returns:
        The names of the files.

    Raises:
        UserError: if the bag cannot be written, or a time is none that a stamp can hold. Then there
            is no folder.
    """
    path = next(p for p in (folder / f"bag-{i}" for i in range(1, 100_000)) if not p.exists())
    _require_stamps(gathered, start, path)
    try:
        with RosBag(path) as bag:
            log = _Log(check, gathered, start, bag)
            for message in heapq.merge(log.states(), log.readings(), log.notes()):
                bag.write(message.topic, message.kind, start + message.time, message.message)
    except OSError as error:
        shutil.rmtree(path, ignore_errors=True)
        raise UserError(f"{path}: the bag cannot be written: {error.strerror}") from error
    return [f"{path.name}/{file.name}" for file in sorted(path.iterdir())]


def _require_stamps(gathered: Gathered, start: float, path: Path) -> None:
    times = [s.time for s in gathered.states] + [f.time for _, f in gathered.frames]
    times += [e.time for e in gathered.events] + [at for at, _ in gathered.said]
    stamps = start + np.array([*times, *gathered.times()])
    if len(stamps) and not (stamps.min() >= 0 and stamps.max() < _LATEST):
        span = f"{stamps.min():.0f} to {stamps.max():.0f} s since 1970"
        raise UserError(f"{path}: found times from {span}, wanted: 0 to {_LATEST:.0f} for a bag")


class _Log:
    """Makes the messages of a log, each kind in the order of time."""

    def __init__(self, check: PlannedCheck, gathered: Gathered, start: float, bag: RosBag) -> None:
        self._check, self._gathered, self._start, self._make = check, gathered, start, bag
        self._placed = PlacedSetup(check.scene, check.setup, 0, Path())

    def states(self) -> Iterator[_Message]:
        """Yield joint states and transforms."""
        states, names, last = self._gathered.states, self._check.scene.robot.chain.joints, -math.inf
        if states:
            at = self._start + states[0].time
            fixed = self._make.transforms(at, fixed_frames(self._placed))
            yield _Message(states[0].time, 0, STATIC, TRANSFORMS, fixed)
        for state in states:
            at = self._start + state.time
            joints = self._make.joints(at, names, state.q)
            yield _Message(state.time, 1, "/joint_states", JOINTS, joints)
            if state.time >= last + _PERIOD:
                last = state.time
                (moved,) = moved_frames(self._placed, state.q[None])
                yield _Message(state.time, 2, "/tf", TRANSFORMS, self._make.transforms(at, moved))

    def readings(self) -> Iterator[_Message]:
        """Yield all readings, as their frames arrived."""
        gathered, groups = self._gathered, self._check.setup.groups
        measured, farthest = gathered.times(), _farthest(gathered, len(groups))
        order = sorted(range(len(measured)), key=lambda i: gathered.frames[i][1].time)
        for i in order:
            ring, frame = gathered.frames[i]
            at = self._start + float(measured[i])
            for k in np.flatnonzero(frame.status != ABSENT).tolist():
                name, sensor = f"tof_{ring}_{k}", groups[ring].sensor
                rank = 3 + k
                if frame.zones is not None and zone_grid(sensor) != (1, 1):
                    status = frame.zones.status[k, ..., 0]
                    points = zone_points(frame.zones.distance[k, ..., 0], status, groups[ring])
                    cloud = self._make.points(at, name, points, status)
                    yield _Message(frame.time, rank, f"/{name}/zones", POINTS, cloud)
                    continue
                limits = (0.0, max(sensor.range_m, farthest[ring]))
                far = range_of(float(frame.distance[k]), int(frame.status[k]))
                read = self._make.range(at, name, beam_angle(sensor), limits, far)
                yield _Message(frame.time, rank, f"/{name}", RANGE, read)

    def notes(self) -> Iterator[_Message]:
        """Yield the steps of the check, and what happened."""
        names = ring_names(self._check.setup)
        messages = [note for said in self._gathered.said for note in self._said(*said)]
        for e in self._gathered.events:
            level = _INFORMATION if e.what is Happened.BACK else _WARNING
            text = f"{e.what.value}{': ' + e.detail if e.detail else ''}"
            messages.append(self._line(e.time, level, names[e.ring], text))
        yield from sorted(messages, key=lambda message: message[:2])

    def _said(self, time: float, note: dict[str, Any]) -> Iterator[_Message]:
        match note:
            case {"what": "begin", "step": str(step), "number": int(number)}:
                text = step if step == "self" else f"{step} {number}"
                yield _Message(time, 1, STEPS, TEXT, self._make.text(text))
            case {"what": "end"}:
                yield _Message(time, 0, STEPS, TEXT, self._make.text("end"))
            case {"what": "warning", "text": str(text)}:
                yield self._line(time, _WARNING, "check", text)
            case {"what": str(what)}:
                more = ", ".join(f"{k} {v}" for k, v in note.items() if k != "what" and v != "")
                text = f"{what}: {more}" if more else what
                yield self._line(
                    time, _ERROR if what == "link ended" else _INFORMATION, "check", text
                )

    def _line(self, time: float, level: int, name: str, text: str) -> _Message:
        message = self._make.log(self._start + time, level, name, text)
        return _Message(time, 2, "/rosout", LOG, message)


def _farthest(gathered: Gathered, rings: int) -> list[float]:
    """Return the largest reading of each ring, m."""
    farthest = [0.0] * rings
    for ring, frame in gathered.frames:
        valid = frame.distance[frame.status == Status.VALID]
        farthest[ring] = max(farthest[ring], float(valid.max(initial=0.0)))
    return farthest
