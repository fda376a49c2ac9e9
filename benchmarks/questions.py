"""Commands for common questions: answer and time of each.

Run: python benchmarks questions
"""

import json
import re
import resource
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from common import table

PAGE = Path(__file__).parent.parent / "docs" / "tutorials" / "place.md"


def asked() -> list[tuple[str, str]]:
    """Return question and command of each row in the table of questions and answers."""
    rows = re.findall(
        r"^\| ([^|`]+) \| `(--target [^`]+)` \| .+ \| \d+ \|$", PAGE.read_text(), re.MULTILINE
    )
    return [(question, f"place-rings {options}") for question, options in rows]


def answer(command: str) -> tuple[int, dict[str, float], float]:
    """Run a command.

    Returns:
        Number of sensors, ζ in percent by target, and processor seconds of the whole process /
            number of processors.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = [
            sys.executable,
            "-m",
            "place_rings.cli.entry",
            *shlex.split(command)[1:],
            "--json",
            "--out",
            folder,
        ]
        before = _spent()
        said = subprocess.run(words, check=True, capture_output=True, text=True, cwd=folder).stdout
        seconds = _spent() - before
    proposal = json.loads(said)["proposal"]
    zeta = {
        z["target"] + ("" if z["radius"] is None else f"({z['radius']:g})"): z["zeta_percent"]
        for z in proposal["zeta"]
    }
    return sum(ring["count"] for ring in proposal["rings"]), zeta, seconds


def _spent() -> float:
    """Return processor seconds of ended child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def report() -> list[str]:
    """Run each command once in a new process."""
    rows = []
    for question, command in asked():
        sensors, zeta, seconds = answer(command)
        rows.append(
            (
                question,
                f"`{command}`",
                sensors,
                ", ".join(f"{k} {v:.2f}" for k, v in zeta.items()),
                f"{seconds:.0f}",
            )
        )
        print(*rows[-1], flush=True)
    return [
        (
            "Each command runs once, from the start of the process to its last file. Seconds are"
            " processor seconds: about the time on an idle machine, as a search uses one thread."
        ),
        "",
        *table(("question", "command", "sensors", "ζ, %", "seconds"), rows),
    ]
