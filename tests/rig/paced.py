"""Frames of rings that fire in slots, in simulated time."""

import json

import numpy as np
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.check.timing_check import RingFrames
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.rings.protocol import Frame, Status
from place_rings.rig.robot.state import State
from place_rings.rig.simulated.frame_pace import FramePace
from place_rings.rig.simulated.ports import ENCODERS

from .tape import about_file, assessed, recording_of


def frames_of(pace, count, rng, seconds=6.0, late=0.0, slower=1.0, lost=0.0, noise=0.004):
    """What a ring sends: each reading stays until the sensor's next slot."""
    paced, frames, number = FramePace(pace, count, late, slower), [], 0
    distance = np.ones(count)
    while (at := paced.due(number)) < seconds:
        new = np.round(1 + rng.normal(0, noise, count), 3)
        distance = np.where(paced.fresh(number), new, distance)
        if rng.random() >= lost:
            frames.append(Frame(at, at, number, distance, np.full(count, Status.VALID)))
        number += 1
    return frames


def heard(frames, rng, delay=0.0, drift=0.0, jitter=0.0):
    """These frames as a host times them."""
    sent = np.array([frame.clock for frame in frames])
    times = delay + (1 + drift) * sent + rng.uniform(-jitter, jitter, len(sent))
    return RingFrames.of(frames, times - 3.0)


def recorded_check(file, scene, setup, paces, rng, faults=(), judge=True):
    """The assessment of a recorded self check of a rig as proposed whose rings keep their paces;
    ``faults`` are by ring: those of ``FramePace``, and a share of frames that is lost. ``judge``
    says whether the schedule is expected."""
    more = {"wave": False, "seconds": 6.0, "paces": paces if judge else (), "faults": "none"}
    asked = about_file("paced", scene, setup, None, [], **more)
    checked, q = PlannedCheck.read("paced", asked.header), scene.poses[0].q
    world = checked.injected.world(scene)
    records = [Record(Kind.EVENT, 0, 100.0, note(what="begin", step="self", number=0))]
    for n in range(750):
        state = State(100 + n / 125, n / 125, np.array(q), np.zeros(6))
        records.append(Record(Kind.STATE, 0, state.time, state.pack()))
    for i, true in enumerate(world.seen(q[None])):
        wrong = dict(faults).get(i, {})
        lost = wrong.pop("lost", 0.0)
        ring, number = FramePace(paces[i], setup.groups[i].count, **wrong), 0
        distance, status = world.told(rng, true[0])
        while (at := ring.due(number)) < 5.99:
            new, fresh = world.told(rng, true[0]), ring.fresh(number)
            distance, status = np.where(fresh, (new[0], new[1]), (distance, status))
            data = ENCODERS["place-rings"](number, 5 + at, distance, status.astype(int))
            if rng.random() >= lost:
                records.append(Record(Kind.BYTES, i, 100 + at + rng.uniform(0, 0.003), data))
            number += 1
    records += [Record(Kind.EVENT, 0, 106.0, note(what=what, why="")) for what in ("end", "ended")]
    with recording_of(file, asked) as recording:
        for record in sorted(records, key=lambda record: record.time):
            recording.put(record)
    return assessed(file, checked).result


def note(**words):
    return json.dumps(words).encode()
