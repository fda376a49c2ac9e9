"""Start-up time of commands

Processor seconds of a whole process with all its threads, as a ratio to those of ``import jax`` in
the same rounds, because a busy machine stretches both. In every round each command runs once, in a
new folder. Python's compiled files are in place, as after an installation, whatever the environment
says about writing them.
"""

import os
import resource
import statistics
import subprocess
import sys
from collections.abc import Sequence
from tempfile import TemporaryDirectory

from common import table

_SHELL = ("--target", "V_S", "--radius", "0.5")
# arguments of the command, and the largest allowed ratio
_COMMANDS: dict[tuple[str, ...], float] = {
    ("--help",): 0.45,
    ("robots",): 0.8,
    ("schema", "scene"): 0.8,
    ("sensors",): 0.8,
    ("verify", "n3_16_55", *_SHELL): 2.0,
    (*_SHELL, "--paper"): 8.0,
}
_ROUNDS = 5


def processor_seconds(arguments: Sequence[str], compiled: str) -> float:
    """Return the processor time of a Python process with these arguments and its children.

    Args:
        arguments: the arguments of Python.
        compiled: folder of the compiled files.
    """
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = compiled
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with TemporaryDirectory() as folder:
        command = [sys.executable, *arguments]
        subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def report(options: Sequence[str] = ()) -> list[str]:
    """Measure alternately; ``--rounds=N`` sets the number of rounds."""
    rounds = _ROUNDS
    for option in options:
        name, _, value = option.partition("=")
        if name != "--rounds" or not value.isdecimal() or not int(value):
            raise SystemExit(f"{option}: no such option; use --rounds=N")
        rounds = int(value)
    lines = {words: ("-m", "place_rings.cli.entry", *words) for words in _COMMANDS}
    lines = {("import jax",): ("-c", "import jax"), **lines}
    seconds = {words: [] for words in lines}
    with TemporaryDirectory() as compiled:
        for arguments in lines.values():
            processor_seconds(arguments, compiled)  # the first run compiles Python's files
        for _ in range(rounds):
            for words, arguments in lines.items():
                seconds[words].append(processor_seconds(arguments, compiled))
    medians = {words: statistics.median(each) for words, each in seconds.items()}
    jax = medians[("import jax",)]
    rows = [
        (f"`place-rings {' '.join(words)}`", *(f"{n:.2f}" for n in (took, took / jax)), f"{most:g}")
        for words, most in _COMMANDS.items()
        for took in [medians[words]]
    ]
    return [
        f"Medians of {rounds} rounds. `import jax`: {jax:.2f} processor seconds.",
        "",
        *table(("command", "processor seconds", "ratio to `import jax`", "limit"), rows),
    ]
