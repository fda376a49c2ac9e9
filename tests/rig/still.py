"""Self checks of a real rig that stands still, recorded without a process or waiting."""

import json

import numpy as np
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.robot.state import RobotMode, State

from .commands import call
from .tape import about_file, recording_of

HZ, EVERY = 125, 5  # states a second, states between two frames


def checked_still(
    folder, scene, setup, sent, decoder="place-rings", frames=60, mode=RobotMode.RUNNING
):
    """The exit code and check.json of a check of rings that send ``sent(ring, n)`` 25 times a
    second.
    """
    ports = [
        Port(name=f"port {i}", count=g.count, decoder=decoder, baud=460800)
        for i, g in enumerate(setup.groups)
    ]
    real = {"simulated": False, "wave": False, "ports": ports, "seconds": frames * EVERY / HZ}
    asked = about_file("still.toml", scene, setup, None, [], **real)
    folder.mkdir(exist_ok=True)
    with recording_of(folder / "still.rig", asked) as recording:

        def say(at, **note):
            recording.put(Record(Kind.EVENT, 0, at, json.dumps(note).encode()))

        for n in range(EVERY * frames):
            t = 100 + n / HZ
            state = State(t, t - 90, np.array(scene.poses[0].q), np.zeros(6), mode=mode)
            recording.put(Record(Kind.STATE, 0, t, state.pack()))
            if n == 0:
                say(t, what="begin", step="self", number=0)
            if n % EVERY == 2:
                for i in range(len(ports)):
                    recording.put(Record(Kind.BYTES, i, t, sent(i, n // EVERY)))
        say(t, what="end")
        say(t, what="ended", why="")
    code = call("check", "--replay", folder / "still.rig", "--out", folder / "out")
    return code, json.loads((folder / "out" / "check.json").read_text())
