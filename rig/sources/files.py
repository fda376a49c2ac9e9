"""The files of a rig, and the data that they hold."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...coverage.definitions.errors import shown
from ...coverage.rings.ring import Setup
from ...coverage.robots.robot import Robot
from ..robot.vetting import GAP
from ..session.gathering import Gathered
from .bags import bag, is_bag
from .joint_track import STANDING, JointTrack
from .messages import JointMessage, RangeMessage, RigFile, StepMessage, listed, refuse
from .names import RigNames
from .ring_track import RingTrack
from .standstills import Standstill, standstills
from .tables import joint_table, range_table, step_table

_STEP = re.compile(r"(?P<step>self|wave|mount|before|trial)(?: (?P<number>\d{1,6}))?")
_SHOWN = 12  # names in an error
_TOPICS = 3  # topics that name a ring's line


@dataclass(frozen=True)
class RigFiles:
    """Where joint states, readings and steps come from: bags, MCAP or CSV; one may hold all."""

    joints: RigFile
    """Holds the joint states."""
    readings: RigFile
    """Holds the readings."""
    steps: RigFile | None
    """Holds the steps of the check; None if nothing does."""

    @staticmethod
    def of(
        robot: Robot, topic: str, joints: Path, readings: Path | None, steps: Path | None
    ) -> "RigFiles":
        """Open the files.

        Args:
            robot: whose joint states they hold.
            topic: of the steps in a bag.
            joints: the file of the joint states.
            readings: the file of the readings; None: that of the joint states.
            steps: the file of the steps; None: that of the joint states if it is a bag.

        Raises:
            UserError: if one cannot be read.
        """
        bags = {
            path: bag(path, topic) for path in {joints, readings, steps} if path and is_bag(path)
        }
        readings = readings or joints
        steps = steps or (joints if joints in bags else None)
        return RigFiles(
            bags.get(joints) or joint_table(joints, robot),
            bags.get(readings) or range_table(readings),
            None if steps is None else bags.get(steps) or step_table(steps),
        )


@dataclass(frozen=True)
class FileData:
    """The data of a rig's files."""

    gathered: Gathered
    """States, frames, events and notes, as a live check gathers them."""
    still: list[Standstill]
    """When the robot stood still."""
    topics: list[str]
    """Topics or files of each ring."""


def read_files(
    files: RigFiles, setup: Setup, robot: Robot, names: RigNames, rings: Sequence[str]
) -> FileData:
    """Read all data of a rig, each file once.

    Args:
        files: the files.
        setup: the rings.
        robot: the robot.
        names: of joints and sensors in the files.
        rings: names of the rings and single sensors.

    Raises:
        UserError: if a file is damaged, holds no states of the robot or no readings of a ring, or
            states and readings are of different times.
    """
    reader = _Reader(files, setup, robot, names)
    for file in dict.fromkeys((files.joints, files.readings, files.steps)):
        if file is not None:
            reader.read(file)
    joints = reader.joints
    joints.close(files.joints.name)
    reader.require(files.readings.name, rings)
    data = Gathered(states=joints.states(), patience=max(joints.gap / GAP, 1.0), standing=STANDING)
    for i, track in enumerate(reader.tracks):
        data.frames += [(i, frame) for frame in track.frames]
        data.events += track.events()
        data.counts.append(track.counts)
    data.said += reader.said
    start = float(joints.time[0])
    if joints.left_out:
        text = f"joint states: left out because they cannot be true: {'; '.join(joints.left_out)}"
        data.said.append((start, {"what": "warning", "text": text}))
    if not joints.q.any():
        text = (
            "joint states: all are exactly zero: the arm stands there, or its driver is not ready"
        )
        data.said.append((start, {"what": "warning", "text": text}))
    gaps = joints.gaps()
    if len(gaps):
        text = (
            f"joint states: {len(gaps)} gaps of more than {joints.gap:.2f} s, the longest"
            f" {gaps.max():.2f} s; readings in them are left out"
        )
        data.said.append((start, {"what": "warning", "text": text}))
    still = standstills(joints.time, joints.q, max(joints.gap, STANDING))
    return FileData(data, still, [listed(t.topics, _TOPICS) for t in reader.tracks])


def _step_note(name: str, message: StepMessage) -> dict[str, Any]:
    """Return the note of a step in file ``name``: begin or end.

    Raises:
        UserError: if the text is no step.
    """
    text = message.text.strip()
    if text == "end":
        return {"what": "end"}
    match = _STEP.fullmatch(text)
    if match is None or (match["number"] is None and match["step"] != "self"):
        where = f"{shown(message.topic)} at {message.time:.3f} s"
        found = f"the step {shown(text)}"
        wanted = "self, wave N, mount N, before N, trial N or end"
        raise refuse(name, where, found, wanted)
    return {"what": "begin", "step": match["step"], "number": int(match["number"] or 0)}


class _Reader:
    """Sorts the messages of all files."""

    def __init__(self, files: RigFiles, setup: Setup, robot: Robot, names: RigNames) -> None:
        self._files, self._names = files, names
        self.joints = JointTrack(robot, names.joints)
        self.tracks = [RingTrack(i, group.count) for i, group in enumerate(setup.groups)]
        self.said = list[tuple[float, dict[str, object]]]()
        self._others = dict[str, None]()
        self._heard = dict[tuple[int, int], str]()

    def read(self, file: RigFile) -> None:
        """Take those messages of a file that are wanted from it."""
        for message in file.messages():
            match message:
                case JointMessage() if file is self._files.joints:
                    self.joints.take(file.name, message)
                case RangeMessage() if file is self._files.readings:
                    self._reading(file.name, message)
                case StepMessage() if file is self._files.steps:
                    self.said.append((message.time, _step_note(file.name, message)))
        if file is self._files.readings:
            for track in self.tracks:
                track.close(file.name)

    def _reading(self, name: str, message: RangeMessage) -> None:
        at = self._names.sensor(message.frame, message.topic)
        if at is None:
            if len(self._others) < _SHOWN:
                self._others[message.frame or message.topic] = None
            return
        topic = self._heard.setdefault(at, message.topic)
        if topic != message.topic:
            ring, sensor = at
            where = f"sensor tof_{ring}_{sensor}"
            found = f"the topics {shown(topic)} and {shown(message.topic)}"
            raise refuse(name, where, found, "one; --map NAME=SOURCE names it")
        self.tracks[at[0]].take(name, at[1], message)

    def require(self, name: str, rings: Sequence[str]) -> None:
        """Raise UserError if a ring has no readings, or none while joint states are known."""
        for i, track in enumerate(self.tracks):
            if not track.frames:
                found = ", ".join(map(shown, self._others)) or "none"
                found = f"no reading of its sensors, and of other frames: {found}"
                wanted = f"the frames tof_{i}_0 …; --map NAME=SOURCE states others"
                raise refuse(name, f"ring {rings[i]}", found, wanted)
        time = self.joints.time
        read = np.array([f.time for track in self.tracks for f in track.frames])
        if read.max() < time[0] or read.min() > time[-1]:
            found = f"readings from {read.min():.3f} to {read.max():.3f} s"
            wanted = f"some between {time[0]:.3f} and {time[-1]:.3f} s, as the joint states"
            raise refuse(name, "times", found, wanted)
