"""The firmware of a ring, compiled for this machine against stand-ins of its board's headers, on a
simulated I2C bus."""

import atexit
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from place_rings.formats.firmware.sketch import sketch
from place_rings.formats.firmware.wiring import FIRST_MULTIPLEXER, RingWiring
from place_rings.rig.rings.protocol import Counts, Decoder, Frame, Status

HOST = Path(__file__).parent / "firmware_host"
COMPILER = next((path for name in ("g++", "c++", "clang++") if (path := shutil.which(name))), None)
WARNINGS = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic")
ARCHITECTURE = {"pico": "ARDUINO_ARCH_RP2040"}  # otherwise ARDUINO_ARCH_ESP32
_WORDS = {Status.VALID: 9, Status.NO_TARGET: 4, Status.WEAK: 6, Status.FAILED: 3}
CODES = {
    "vl53l1x": _WORDS,
    "vl53l4cd": _WORDS,
    "vl53l5cx": {Status.VALID: 5, Status.NO_TARGET: 255, Status.WEAK: 6, Status.FAILED: 0},
    "vl53l0x": {Status.VALID: 11, Status.NO_TARGET: 4, Status.WEAK: 8, Status.FAILED: 1},
}
"""What a sensor's status register holds, by driver and by the status that is meant."""


@dataclass(frozen=True)
class Run:
    """What came of a run."""

    frames: list[Frame]
    """Frames that our own decoder read."""
    counts: Counts
    """What the decoder counted."""
    sda: int
    scl: int
    """Pins of the bus."""
    hertz: int
    """Clock of the bus."""
    busy: float
    """Share of the time in which the bus transferred."""
    pins: set[int]
    """Other pins that the sketch drove."""
    longest_s: float
    """Longest time between two frames, s."""
    light: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    """Begin and end of each ranging of each sensor, µs of the board, with the event ``light``."""
    edges: list[int] = field(default_factory=list)
    """Rising edges on the watched pin, µs of the board."""


def compiled(*words: object) -> None:
    done = subprocess.run([COMPILER, *map(str, words)], capture_output=True, text=True)
    assert not done.returncode, done.stderr


@cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="place-rings-firmware-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def _simulator() -> Path:
    made = _folder() / "simulator.o"
    compiled("-c", *WARNINGS, "-O1", HOST / "simulator.cpp", "-o", made)
    return made


@cache
def _program(files: tuple[tuple[str, bytes], ...], board: str) -> Path:
    folder = Path(tempfile.mkdtemp(dir=_folder()))
    for name, data in files:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    (ino,) = folder.glob("*/*.ino")
    compiled(
        *WARNINGS,
        f"-D{ARCHITECTURE.get(board, 'ARDUINO_ARCH_ESP32')}",
        f'-DSKETCH="{ino}"',
        *(f"-I{HOST / part}" for part in ("core", "libraries", f"boards/{board}")),
        HOST / "main.cpp",
        _simulator(),
        "-o",
        folder / "run",
    )
    return folder / "run"


def build_files(folder: Path, name: str, board: str) -> Path:
    """Compile the sketch that lies in the folder ``name`` of an exported folder."""
    code = {f"{name}/{file.name}": file.read_bytes() for file in (folder / name).iterdir()}
    return _program(tuple(code.items()), board)


def build(wiring: RingWiring, board: str = "") -> Path:
    """Compile a ring's sketch with the headers of its board, or of another; equal sketches are
    compiled once."""
    code = {name: data for name, data in sketch(wiring).items() if not name.endswith(".md")}
    return _program(tuple(code.items()), board or wiring.controller.name)


def run(
    program: Path,
    wiring: RingWiring,
    readings: Sequence[tuple[int, Status]],
    events: Sequence[str] = (),
    seconds: float = 2.0,
) -> Run:
    """Run a compiled sketch, wired as its page says.

    Args:
        program: the compiled sketch.
        wiring: how its sensors are wired.
        readings: distance in mm, and status, that each sensor measures from the start.
        events: further events of the scenario, ``at MS …``.
        seconds: simulated time.
    """
    kind, codes = wiring.driver.name, CODES[wiring.driver.name]
    lines = [
        *(f"sensor {kind} xshut {pin}" for pin in wiring.xshut),
        *(f"sensor {kind} channel {FIRST_MULTIPLEXER + m} {c}" for m, c in wiring.places),
        *([] if wiring.reset is None else [f"reset {wiring.reset}"]),
        *(f"at 0 reading {i} {mm} {codes[status]}" for i, (mm, status) in enumerate(readings)),
        *events,
        f"run {round(1000 * seconds)}",
    ]
    done = subprocess.run([program], input="\n".join(lines).encode(), capture_output=True)
    assert not done.returncode, done.stderr.decode()
    words = [*map(str.split, done.stderr.decode().splitlines())]
    report = {line[0]: line[1:] for line in words}
    light: dict[int, list[tuple[int, int]]] = {i: [] for i in range(wiring.count)}
    for line in words:
        if line[0] == "light":
            light[int(line[1])].append((int(line[2]), int(line[3])))
    decoder = Decoder(wiring.count)
    sda, scl, hertz, busy_us, us = map(int, report["bus"])
    return Run(
        decoder.feed(done.stdout, 0.0),
        decoder.counts,
        sda,
        scl,
        hertz,
        busy_us / us,
        set(map(int, report["pins"])),
        int(report["longest_us"][0]) / 1e6,
        light,
        [int(line[1]) for line in words if line[0] == "edge"],
    )
