"""The questions of README's table: what each command answers, and how long it takes.

Run: python benchmarks questions
"""

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import table

README = Path(__file__).parent.parent / "README.md"


def asked() -> list[tuple[str, str]]:
    """Question and command of each row that README's table has."""
    return re.findall(r"^\| ([^|`]+) \| `(place-rings --target [^`]+)` \| ", README.read_text(), re.MULTILINE)


def answer(command: str) -> tuple[int, dict[str, float], float]:
    """Sensors, zeta in percent by target, and seconds of the whole process, from start to the last file."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "place_rings.cli.entry", *shlex.split(command)[1:], "--json", "--out", folder]
        began = time.perf_counter()
        said = subprocess.run(words, check=True, capture_output=True, text=True, cwd=folder).stdout
        seconds = time.perf_counter() - began
    proposal = json.loads(said)["proposal"]
    zeta = {z["target"] + ("" if z["radius"] is None else f"({z['radius']:g})"): z["zeta_percent"] for z in proposal["zeta"]}
    return sum(ring["count"] for ring in proposal["rings"]), zeta, seconds


def report() -> list[str]:
    """Each question once, as a new process."""
    rows = []
    for question, command in asked():
        sensors, zeta, seconds = answer(command)
        rows.append(
            (question, f"`{command}`", sensors, ", ".join(f"{k} {v:.2f}" for k, v in zeta.items()), f"{seconds:.0f}")
        )
        print(*rows[-1], flush=True)
    busy = os.getloadavg()[2]
    return [
        f"Each command once, from a process's start to its last file; the machine's mean load beside was {busy:.1f}.",
        "",
        *table(("question", "command", "sensors", "ζ, %", "seconds"), rows),
    ]
