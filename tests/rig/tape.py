"""A whole check of a simulated rig, recorded without a process or waiting, and assessed."""

import json

import numpy as np
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.rig.check.assessment import assess
from place_rings.rig.check.check_data import CheckData
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.rings.protocol import hello
from place_rings.rig.robot.state import State
from place_rings.rig.session.gathering import replay
from place_rings.rig.simulated.ports import ENCODERS
from place_rings.rig.simulated_cell.cell import SimulatedCell
from place_rings.rig.simulated_cell.world import DEAD

HZ, EVERY = 125, 5  # states a second, states between two frames


def about_file(name, scene, setup, stops, plans, **more):
    """What a check of ``setup`` records first; ``stops`` may be None."""
    ports = enumerate(setup.groups)
    usual = {
        "simulated": True,
        "ports": [Port(name=f"port {i}", count=g.count, baud=460800) for i, g in ports],
        "seconds": 1.0,
        "wave": True,
        "voxel": 0.1,
    }
    about = {"name": name, "proposal": ProposalFile.of(setup, scene), "seed": 3, "moved": True}
    about |= {"stale_s": 0.08, "stops": stops, "trials": plans, "version": "0"}
    return PlannedCheck(**about | usual | more)


def recording_of(file, asked):
    """A recording that begins as that of a check does."""
    return Recording(file, {"check": asked.header})


def assessed(file, checked):
    """The assessment of a recorded check."""
    recorded = RecordingReader(file)
    gathered = replay(recorded.records(), checked.ports, checked.stale_s)
    return assess(CheckData(checked, gathered, 0.0, recorded.damage))


def rows(gathered):
    """Time, joints, ring, sensor, distance and status of all readings."""
    return list(vars(gathered.readings()).values())[:6]


class Tape:
    """Records what a rig would tell that stands at one pose after another, a second apart."""

    def __init__(self, recording, checked, seed=0, ports=None, serials=()):
        """``ports`` are those of the rings, if they are swapped."""
        self.put, self.now, self.sequence = recording.put, 100.0, 0
        self.ports, self.serials = ports or range(9), serials
        self.world, self.rng = checked.injected.world(checked.scene), np.random.default_rng(seed)

    def say(self, what, at, **more):
        self.put(Record(Kind.EVENT, 0, at, json.dumps({"what": what, **more}).encode()))

    def stand(self, q, step, number, frames, rod=None):
        seen = [ring[0] for ring in self.world.seen(q[None], rod)]
        self.tell(q, step, number, [seen] * (frames + 2))

    def wave(self, q, ring):
        """A hand before one seat after another, four frames each."""
        cell, seen = SimulatedCell(self.world), []
        for seat in range(cell.counts[ring]):
            cell.tell({"hand": [ring, seat]})
            seen += [cell.see(q)] * 4
        self.tell(q, "wave", ring, seen)

    def tell(self, q, step, number, seen):
        self.now += 1.0
        for n in range(EVERY * len(seen)):
            t = self.now + n / HZ
            state = State(t, t - 90, np.array(q), np.zeros(6))
            self.put(Record(Kind.STATE, 0, t, state.pack()))
            if n % EVERY == 2:
                told = [self.world.told(self.rng, true) for true in seen[n // EVERY]]
                for i, ring in enumerate(self.world.mounted.groups):
                    data = ENCODERS["place-rings"](self.sequence, t - 95, *told[i])
                    if self.serials and self.sequence % 16 == 0:
                        data += hello(ring.count, self.serials[i])
                    self.put(Record(Kind.BYTES, self.ports[i], t, data))
                self.sequence += 1
            if n == 0:
                self.say("begin", t, step=step, number=number)
        self.now += EVERY * len(seen) / HZ
        self.say("end", self.now)


def record(file, asked, mute=(), **more):
    """A whole check, as a recording, in which the sensors ``mute`` never answer."""
    checked = PlannedCheck.read("tape", asked.header)
    with recording_of(file, asked) as recording:
        tape, plans, q = Tape(recording, checked, **more), checked.plans, checked.scene.poses[0].q
        tape.world.seat[list(mute)] = DEAD
        tape.stand(q, "self", 0, 20)
        for group in range(len(checked.setup.groups) if plans.wave else 0):
            tape.wave(q, group)
        for i, stop in enumerate(plans.mount.joints if plans.mount else ()):
            tape.stand(stop, "mount", i, 8)
        if plans.rods:
            tape.stand(plans.rods[0].joints[0], "before", 0, 20)
        for i, (plan, point) in enumerate((rod, x) for rod in plans.rods for x in rod.point):
            tape.stand(plan.joints[0], "trial", i, 10, plan.rod.at(point[None]))
        tape.say("ended", tape.now, why="")
    return file, checked
