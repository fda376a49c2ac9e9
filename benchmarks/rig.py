"""The rig's faults, each at random moments: what happens, and how soon it is found.

Run: python benchmarks rig               the section of the report, 20 runs of each
     python benchmarks/rig.py 2          2 runs of each, printed
"""

import os
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import psutil
from common import table
from place_rings.rig.decoders import DECODERS, decoder
from place_rings.rig.gathering import replay
from place_rings.rig.health import SILENT, Event, Happened, Port
from place_rings.rig.link import START
from place_rings.rig.motion import Limits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.recording import Recorded, Recording
from place_rings.rig.records import Kind
from place_rings.rig.rings import Rings
from place_rings.rig.session import Session
from place_rings.rig.simulated.ports import ENCODERS
from place_rings.rig.simulated.process import SimulatedRig, command
from place_rings.rig.vetting import STALE, Ended, LinkFaultError

RUNS = 20
_HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
_OWN = 0.02  # s, between being given a vector and looking at the clock
_DRIFT = 0.002  # s, that clocks may have drifted apart in a run
_PATIENCE = 4.0  # s, for a robot to answer
_WAIT = 3.0  # s, for a fault to be found
_PLAIN = ("-m", "place_rings.rig.simulated")
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
_RINGS: dict[str, tuple[str, dict, dict, tuple[Happened, ...], float]] = {  # fault, its end, events, bound in s
    "unplugged": ("unplug", {}, {"do": "plug"}, (Happened.GONE,), 0.02),
    "plugged in again": ("plug", {}, {"do": "plug"}, (Happened.BACK,), 0.05 + 1 / 15),
    "silent": ("silent", {}, {"do": "silent", "on": False}, (Happened.SILENT,), SILENT + 0.02),
    "speaks another language": ("garble", {"on": True}, {"do": "garble", "on": False}, (Happened.GARBLED,), SILENT + 1 / 15),
    "1 % of bytes changed": (
        "corrupt",
        {"share": 0.01},
        {"do": "corrupt", "share": 0},
        (Happened.NOISY, Happened.GARBLED),
        2.0,
    ),
    "frames out of order, one in four": (
        "disorder",
        {"share": 0.33},
        {"do": "disorder", "share": 0},
        (Happened.NOISY,),
        3.0,
    ),
}

_MOVING = {
    "close": "the robot's side closes",
    "zero": "a header says length 0",
    "stall": "the stream stalls",
    "kill": "the moving client is killed",
    "near": "a near reading",
    "ctrl-c": "Ctrl-C",
}


@dataclass
class Found:
    """What came of a fault's runs. outcomes: how often what. seconds: to be found. wrong: joint vectors that were given
    though stale or untrue. lost: of what was gathered, not in the recording. closing: s, the longest that ending took."""

    outcomes: Counter = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    wrong: int = 0
    given: int = 0
    lost: int = 0
    disturbed: int = 0
    closing: float = 0.0

    def times(self) -> tuple[str, str]:
        """Median and worst, ms."""
        ms = [1000 * s for s in self.seconds]
        return (f"{statistics.median(ms):.0f}", f"{max(ms):.0f}") if ms else ("", "")


class Asker(threading.Thread):
    """Asks a link for joints again and again, and counts those that are older than they may be, or not where the robot
    stands."""

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
            stale = now - state.time > STALE + _OWN or state.time - state.clock - lag > STALE + _DRIFT
            self.given += 1
            self.wrong += bool(stale or np.abs(state.q - _HOME).max() > 1e-9)


@contextmanager
def listening(rig: SimulatedRig, folder: Path, found: Found, start: float = START) -> Iterator[Session]:
    """A session that is recorded, whose link is asked all the time, and whose recording is replayed afterwards."""
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
        again = replay(Recorded(file), ports)
        found.lost += abs(len(session.gathered.states) - len(again.states))
        found.lost += abs(len(session.gathered.frames) - len(again.frames))
        found.given, found.wrong = found.given + asker.given, found.wrong + asker.wrong


def until(check: Callable[[], bool]) -> bool:
    """Whether something comes true in time."""
    end = time.monotonic() + _WAIT
    while not check() and time.monotonic() < end:
        time.sleep(0.002)
    return check()


def robot_fault(rig: SimulatedRig, folder: Path, do: str, more: dict, rng: np.random.Generator, found: Found) -> None:
    """One run of a fault of the robot's, at a random moment."""
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
        found.outcomes[fault.why.value if fault else "nothing: what was cut off did no harm"] += 1
        if fault:
            found.seconds.append(fault.time - done)
    rig.do("heal")


def not_there(rig: SimulatedRig, folder: Path, do: str, found: Found) -> None:
    """One run of connecting to a robot that refuses or never answers."""
    rig.do(do)
    start = time.monotonic()
    with listening(rig, folder, found, _PATIENCE) as session:
        try:
            session.link.wait(_PATIENCE + 1)
        except LinkFaultError as fault:
            found.outcomes[fault.why.value] += 1
            found.seconds.append(fault.time - start)
    rig.do("heal")


def ring_fault(rig: SimulatedRig, name: str, rng: np.random.Generator, found: Found) -> None:
    """One run of a fault of a ring's line, at a random moment."""
    do, more, end, events, _ = _RINGS[name]
    watch, ring = list[Event](), int(rng.integers(2))
    if do == "plug":
        rig.do("unplug", ring=ring)
    with Rings([Port(rig.ring(i), 16) for i in range(2)], on_event=watch.append):
        time.sleep(rng.uniform(0.4, 0.9))
        watch.clear()
        done = rig.do(do, ring=ring, **more)["time"]
        until(lambda: any(e.ring == ring and e.what in events for e in watch))
        event = next((e for e in watch if e.ring == ring and e.what in events), None)
    found.outcomes[event.what.value if event else "not found"] += 1
    if event:
        found.seconds.append(event.time - done)
    rig.do(**{**end, "ring": ring})


def moving_fault(rig: SimulatedRig, kind: str, rng: np.random.Generator, found: Found) -> None:
    """One run of a fault while the robot moves: the time until it stands still."""
    near: list[str] = []
    with Session(rig.address, []) as session:
        session.link.wait()
        limits = Limits(np.tile([-2 * np.pi, 2 * np.pi], (6, 1)))
        with Mover(rig.address, session.link, limits, danger=lambda: near[0] if near else None) as mover:
            deeds: dict[str, Callable[[], object]] = {
                "close": lambda: rig.do("close"),
                "zero": lambda: rig.do("zero"),
                "stall": lambda: rig.do("stall"),
                "kill": mover._process.kill,
                "near": lambda: near.append("a near reading"),
                "ctrl-c": lambda: os.kill(os.getpid(), signal.SIGINT),
            }
            done, still = [], []

            def strike() -> None:
                done.append(time.monotonic())
                deeds[kind]()
                before = rig.do("state")["q"]
                while not still and time.monotonic() < done[0] + 2 * _WAIT:
                    time.sleep(0.02)
                    q = rig.do("state")["q"]
                    if np.abs(np.subtract(q, before)).max() < 1e-4:
                        still.append(time.monotonic())
                    before = q

            timer = threading.Timer(rng.uniform(0.3, 1.5), strike)
            start = session.link.latest().q
            timer.start()
            try:
                mover.move(start + np.where(start > 0, -1, 1) * 1.5)
                what = "it went on"
            except (MoveStoppedError, KeyboardInterrupt) as error:
                what = str(error) or "interrupted"
                if not done:  # the machine kept the link waiting
                    timer.cancel()
                    raise LinkFaultError(Ended.STALE) from None
            timer.join()
            found.outcomes[what if still else f"{what}, but it moved on"] += 1
        found.seconds += [still[0] - done[0]] if still else []
    rig.do("heal")


def victim(rig: SimulatedRig, folder: Path, full: bool, rng: np.random.Generator, found: Found) -> None:
    """One run of a session that is killed, or whose disk is full, at a random moment."""
    file = folder / "victim"
    file.unlink(missing_ok=True)
    most = int(rng.integers(1000, 60000)) if full else 0
    words = [str(Path(__file__).with_name("rig_victim.py")), rig.address, str(file), str(most), rig.ring(0), rig.ring(1)]
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
        until(lambda: not any(c.is_running() and c.status() != psutil.STATUS_ZOMBIE for c in children))
        found.seconds.append(time.monotonic() - struck)
        found.outcomes["the recording is whole up to the kill, the client's process ends"] += 1
    recorded = Recorded(file)
    records = sum(r.kind not in (Kind.ABOUT, Kind.END) for r in recorded.records())
    found.lost += max(int(kept) - records, 0)


def row(name: str, runs: int, run: Callable[[Found], None], bound: str) -> tuple[tuple, Found]:
    """The row of a fault, and what was found in so many runs; those that the machine disturbed are begun again."""
    found = Found()
    while sum(found.outcomes.values()) < runs:
        try:
            run(found)
        except (LinkFaultError, MoveRefusedError) as error:
            found.disturbed += 1
            print("begun again:", name, error, flush=True)
    happened = "; ".join(f"{what} ({n})" for what, n in found.outcomes.most_common())
    given = f"{found.wrong} of {found.given}" if found.given else ""
    cells = (name, runs, happened, *found.times(), bound, given, found.lost)
    print(*cells, f"ending {found.closing:.2f} s", sep=" | ", flush=True)
    return cells, found


def of_robot(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Rows of the robot's faults, and of the check's own."""
    rng, rows = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as place, SimulatedRig((_PLAIN, command(2))) as rig:
        folder = Path(place)
        for name, (do, more) in _ROBOT.items():
            bound = "80" if name != "packages fall behind" else "80 behind"
            rows.append(row(name, runs, partial(robot_fault, rig, folder, do, more, rng), bound))
        for name, do in (("the robot refuses to be connected to", "close"), ("it accepts, and never answers", "mute")):
            rows.append(row(name, runs, partial(not_there, rig, folder, do), f"{1000 * _PATIENCE:.0f}"))
        for name, full in (("kill -9 of the check", False), ("the disk is full", True)):
            rows.append(row(name, runs, partial(victim, rig, folder, full, rng), ""))
    return rows


def of_rings(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Rows of the faults of rings' lines."""
    rng = np.random.default_rng(seed)
    with SimulatedRig((_PLAIN, command(2))) as rig:
        return [
            row(f"a ring: {name}", runs, partial(ring_fault, rig, name, rng), f"{1000 * bound:.0f}")
            for name, (*_, bound) in _RINGS.items()
        ]


def of_motion(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Rows of faults while the robot moves."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a job in the background ignores
    rng = np.random.default_rng(seed)
    with SimulatedRig((_PLAIN, command(1))) as rig:
        return [
            row(f"on the move: {name}", runs, partial(moving_fault, rig, kind, rng), "1000")
            for kind, name in _MOVING.items()
        ]


def faults(runs: int, seed: int = 0) -> list[tuple[tuple, Found]]:
    """Rows of the table, and what was found: three parts at once, as each mostly waits."""
    with ProcessPoolExecutor(3, get_context("spawn")) as pool:
        parts = [pool.submit(part, runs, seed) for part in (of_robot, of_rings, of_motion)]
        return [each for part in parts for each in part.result()]


def throughput() -> list[tuple]:
    """Frames a second of each decoder, of 16 sensors, fed in pieces of 64 bytes; and ten rings at 100 Hz through serial
    ports."""
    rows, rng = [], np.random.default_rng(0)
    distance, status = np.round(rng.uniform(0.1, 3, (5000, 16)), 3), np.zeros(16, int)
    for name in DECODERS:
        data = b"".join(ENCODERS[name](i, i / 100, distance[i], status) for i in range(5000))
        best = np.inf
        for _ in range(5):
            reader, start = decoder(name, 16), time.perf_counter()
            count = sum(len(reader.feed(data[i : i + 64], 0.0)) for i in range(0, len(data), 64))
            best = min(best, time.perf_counter() - start)
        rows.append((f"decoder `{name}`", f"{count / best:,.0f} frames/s", f"{len(data) / best / 1e6:.2f} MB/s", ""))
    data, reader, start = rng.bytes(10**7), decoder("place-rings", 16), time.perf_counter()
    count = sum(len(reader.feed(data[i : i + 1024], 0.0)) for i in range(0, len(data), 1024))
    rows.append(("random bytes, 10⁷", f"{count} frames", f"{10 / (time.perf_counter() - start):.0f} MB/s", "0 exceptions"))
    with SimulatedRig((_PLAIN, command(10, 16, 100.0))) as rig:
        with Rings([Port(rig.ring(i), 16) for i in range(10)]) as rings:
            time.sleep(1)
            first, cpu, start = sum(c.frames for c in rings.counts), time.process_time(), time.monotonic()
            time.sleep(20)
            counts, seconds = rings.counts, time.monotonic() - start
            frames, used = sum(c.frames for c in counts) - first, time.process_time() - cpu
            bad = sum(c.lost + c.late + c.corrupt for c in counts)
            dropped = sum(rig.do("counts")["dropped"])
        share = f"{100 * used / seconds:.0f} % of a core"
        rows.append(
            ("ten rings at 100 Hz, 20 s", f"{frames / seconds:,.0f} frames/s", share, f"{bad + dropped} frames lost")
        )
    return rows


def report(runs: int = RUNS) -> list[str]:
    """Both tables."""
    columns = ("fault", "runs", "what happens", "median, ms", "worst, ms", "bound, ms", "joints given wrong", "records lost")
    intro = [
        f"{runs} runs of each, on the simulated rig, through unmodified ur-rtde and pyserial: `python benchmarks rig`.",
        "Times are from the fault's doing to its finding; on the move, to the robot's standing still from 15°/s.",
        "Bounds are without what a busy machine takes to wake a thread (MEAN).",
        "Joints given wrong: vectors that were handed out older than 80 ms, or not where the robot stood, of all asked for.",
        "Records lost: of what was gathered, not in the recording's replay. Ending a session took at most ENDING s.",
        "Runs begun again, as the machine kept the link waiting beyond its bound before anything was done: AGAIN.",
        "",
    ]
    found = faults(runs)
    rows, ending = [cells for cells, _ in found], max(each.closing for _, each in found)
    again = str(sum(each.disturbed for _, each in found))
    load = f"mean load here: {os.getloadavg()[2]:.1f} on {os.cpu_count()} cores"
    head = [line.replace("MEAN", load).replace("ENDING", f"{ending:.2f}").replace("AGAIN", again) for line in intro]
    return head + table(columns, rows) + ["", "Speed:", "", *table(("what", "", "", ""), throughput())]


if __name__ == "__main__":
    print("\n".join(report(int(sys.argv[1]))))
