"""Faults of the robot's side and of the check's own process: killed, or its disk full."""

import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import psutil
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.recording.records import Kind
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.robot.link import START
from place_rings.rig.robot.vetting import STALE, LinkFaultError
from place_rings.rig.session.gathering import replay
from place_rings.rig.session.session import Session
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN, Found, row, until

_HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
_OWN = 0.02  # s, between receiving a vector and reading the clock
_DRIFT = 0.002  # s, largest drift between clocks in a run
_PATIENCE = 4.0  # s, timeout for a robot's answer
_ROBOT: dict[str, tuple[str, dict]] = {
    "the robot's side closes": ("close", {}),
    "the stream stalls": ("stall", {}),
    "the same package comes again and again": ("spoil", {"how": "frozen clock"}),
    "packages fall behind": ("spoil", {"how": "late"}),
    "packages are short": ("spoil", {"how": "short"}),
    "one package is short": ("spoil", {"how": "once short"}),
    "a header says length 0": ("zero", {}),
    "random bytes for joints": ("spoil", {"how": "garbage"}),
    "a joint jumps by 2 to 60°": ("spoil", {"how": "jump"}),
    "a joint is no number": ("spoil", {"how": "nan"}),
    "the robot's safety stops it": ("stop", {}),
    "the client's process is killed": ("", {}),
}


class Asker(threading.Thread):
    """Requests joints from a link repeatedly and counts vectors that are too old or wrong."""

    def __init__(self, session: Session) -> None:
        super().__init__(daemon=True)
        self.session, self.ended, self.given, self.wrong = session, threading.Event(), 0, 0
        self.start()

    def run(self) -> None:
        lag = np.inf
        while not self.ended.wait(0.001):
            try:
                state = self.session.link.latest()
            except LinkFaultError:
                continue
            now = time.monotonic()
            lag = min(lag, state.time - state.clock)
            stale = (
                now - state.time > STALE + _OWN or state.time - state.clock - lag > STALE + _DRIFT
            )
            self.given += 1
            self.wrong += bool(stale or np.abs(state.q - _HOME).max() > 1e-9)


@contextmanager
def listening(
    rig: SimulatedRig, folder: Path, found: Found, start: float = START
) -> Iterator[Session]:
    """Yield a recorded session whose link is queried continuously.

    Its recording is replayed afterwards.
    """
    file = folder / "recording"
    file.unlink(missing_ok=True)
    ports = [Port(rig.ring(i), 16) for i in range(2)]
    session = Session(rig.address, ports, Recording(file, {}), start=start)
    asker = Asker(session)
    try:
        yield session
    finally:
        asker.ended.set()
        asker.join()
        start = time.monotonic()
        session.close()
        found.closing = max(found.closing, time.monotonic() - start)
        again = replay(RecordingReader(file), ports)
        found.lost += abs(len(session.gathered.states) - len(again.states))
        found.lost += abs(len(session.gathered.frames) - len(again.frames))
        found.given, found.wrong = found.given + asker.given, found.wrong + asker.wrong


def robot_fault(
    rig: SimulatedRig, folder: Path, do: str, more: dict, rng: np.random.Generator, found: Found
) -> None:
    """Run a fault of the robot once, at a random moment."""
    with listening(rig, folder, found) as session:
        session.link.wait()
        time.sleep(rng.uniform(0.05, 0.5))
        session.link.latest()
        if do:
            done = rig.do(do, **more)["time"]
        else:
            session.link._process.kill()
            done = time.monotonic()
        until(lambda: session.link.fault is not None)
        fault = session.link.fault
        found.outcomes[fault.why.value if fault else "nothing: the cut part did no harm"] += 1
        if fault:
            found.seconds.append(fault.time - done)
    rig.do("heal")


def not_there(rig: SimulatedRig, folder: Path, do: str, found: Found) -> None:
    """Try once to connect to a robot that refuses or never answers."""
    rig.do(do)
    start = time.monotonic()
    with listening(rig, folder, found, _PATIENCE) as session:
        try:
            session.link.wait(_PATIENCE + 1)
        except LinkFaultError as fault:
            found.outcomes[fault.why.value] += 1
            found.seconds.append(fault.time - start)
    rig.do("heal")


def victim(
    rig: SimulatedRig, folder: Path, full: bool, rng: np.random.Generator, found: Found
) -> None:
    """Run a session once that is killed, or whose disk is full, at a random moment."""
    file = folder / "victim"
    file.unlink(missing_ok=True)
    most = int(rng.integers(1000, 60000)) if full else 0
    words = [
        str(Path(__file__).with_name("rig_victim.py")),
        rig.address,
        str(file),
        str(most),
        rig.ring(0),
        rig.ring(1),
    ]
    with subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        children = psutil.Process(process.pid).children() if not full else []
        if not full:
            time.sleep(rng.uniform(0.05, 1))
            process.send_signal(signal.SIGKILL)
            struck = time.monotonic()
        said = process.stdout.read().splitlines()
    if full:
        kept, ms, line = said[-1].split(maxsplit=2)
        found.seconds.append(float(ms) / 1000)
        found.outcomes[line.partition(": ")[2]] += 1
    else:
        kept = said[-1] if said else "0"
        until(
            lambda: not any(c.is_running() and c.status() != psutil.STATUS_ZOMBIE for c in children)
        )
        found.seconds.append(time.monotonic() - struck)
        found.outcomes["the recording is whole up to the kill, the client's process ends"] += 1
    recorded = RecordingReader(file)
    records = sum(r.kind not in (Kind.ABOUT, Kind.END) for r in recorded.records())
    found.lost += max(int(kept) - records, 0)


def of_robot(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Return the rows of the robot's faults, and of the check's own."""
    rng, rows = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as place, SimulatedRig((PLAIN, command(2))) as rig:
        folder = Path(place)
        for name, (do, more) in _ROBOT.items():
            bound = "80" if name != "packages fall behind" else "80 behind"
            rows.append(row(name, runs, partial(robot_fault, rig, folder, do, more, rng), bound))
        for name, do in (
            ("the robot refuses the connection", "close"),
            ("the robot accepts the connection and never answers", "mute"),
        ):
            rows.append(
                row(name, runs, partial(not_there, rig, folder, do), f"{1000 * _PATIENCE:.0f}")
            )
        for name, full in (("kill -9 of the check", False), ("the disk is full", True)):
            rows.append(row(name, runs, partial(victim, rig, folder, full, rng), ""))
    return rows
