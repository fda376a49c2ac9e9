"""Start-up time of commands.

Processor seconds of a whole process with all its threads, as a ratio to those of ``import jax`` in
the same rounds, because a busy machine stretches both. In every round each command runs once, in a
new folder. Python's compiled files are in place, as after an installation, whatever the environment
says about writing them. With ``--full``, the questions of the docs run, too.
"""

import json
import os
import re
import resource
import shlex
import statistics
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from common import say, table

ROUNDS = {False: 3, True: 7}
_SHELL = ("--target", "V_S", "--radius", "0.5")
# arguments of the command, and the largest ratio wanted
COMMANDS: dict[tuple[str, ...], float] = {
    ("--help",): 0.45,
    ("robots",): 0.8,
    ("schema", "scene"): 0.8,
    ("sensors",): 0.8,
    ("verify", "n3_16_55", *_SHELL): 2.0,
    (*_SHELL, "--paper"): 8.0,
}
PAGE = Path(__file__).parent.parent / "docs" / "tutorials" / "place.md"
_QUESTION = re.compile(r"^\| ([^|`]+) \| `(--target [^`]+)` \| .+ \| \d+ \|$", re.MULTILINE)
_RUN = ("-m", "place_rings.cli.entry")
PLACE = (*_RUN, *_SHELL)
"""Arguments of Python for the default command."""


def run(arguments: Sequence[str], compiled: str) -> tuple[float, str]:
    """Return the processor time of a Python process and its children, s, and what it prints.

    Args:
        arguments: the arguments of Python.
        compiled: folder of the files that Python and, on Linux, JAX compile.
    """
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPYCACHEPREFIX": compiled, "XDG_CACHE_HOME": compiled}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=folder,
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, done.stdout


def report(full: bool) -> list[str]:
    """Measure alternately and return blocks of Markdown."""
    lines = {("import jax",): ("-c", "import jax")} | {c: (*_RUN, *c) for c in COMMANDS}
    seconds = {words: list[float]() for words in lines}
    with TemporaryDirectory() as compiled:
        for arguments in lines.values():
            run(arguments, compiled)  # the first run compiles Python's files
        for _ in range(ROUNDS[full]):
            for words, arguments in lines.items():
                seconds[words].append(run(arguments, compiled)[0])
                say(*words, f"{seconds[words][-1]:.2f}")
        questions = answers(compiled) if full else []
    medians = {words: statistics.median(each) for words, each in seconds.items()}
    jax = medians[("import jax",)]
    rows = [
        (f"`place-rings {' '.join(words)}`", f"{took:.2f}", f"{took / jax:.2f}", f"{most:g}")
        for words, most in COMMANDS.items()
        for took in [medians[words]]
    ]
    columns = ("command", "processor seconds", "ratio to `import jax`", "wanted at most")
    intro = f"Medians of {ROUNDS[full]} rounds. `import jax`: {jax:.2f} processor seconds."
    return [intro, table(columns, rows), *questions]


def answers(compiled: str) -> list[str]:
    """Run each command in the table of questions of the docs once, from the start of its process to
    its last file.
    """
    rows = []
    for question, options in _QUESTION.findall(PAGE.read_text("utf-8")):
        seconds, said = run((*_RUN, *shlex.split(options), "--json"), compiled)
        proposal = json.loads(said)["proposal"]
        zetas = (f"{z['target']} {z['zeta_percent']:.2f}" for z in proposal["zeta"])
        sensors = sum(ring["count"] for ring in proposal["rings"])
        command = f"`place-rings {options}`"
        rows.append((question, command, sensors, ", ".join(zetas), f"{seconds:.0f}"))
        say(*rows[-1])
    columns = ("question", "command", "sensors", "ζ, %", "processor seconds")
    return ["Commands for common questions:", table(columns, rows)]
