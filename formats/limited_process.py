"""Reading in a process of its own, within limits: a file may crash its parser, or claim more memory
than there is."""

import io
import os
import subprocess
import sys
from contextlib import suppress

import numpy as np

MOST_S = 120
"""Time until a reader has to end, s. It limits its processor time itself; this ends one that waits,
and leaves room on a machine that does much else."""


def answer_of(module: str, *arguments: str, data: bytes = b"", seconds: int = MOST_S) -> bytes:
    """Return what a module writes to stdout, or a line that states why it wrote nothing.

    Args:
        module: the module, which a new interpreter runs.
        arguments: its arguments.
        data: its input.
        seconds: time until it has to end.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-m", module, *arguments],
            input=data,
            capture_output=True,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1"},
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return b"a file that takes too long to read"
    if done.returncode == 0 and done.stdout:
        return done.stdout
    return b"a file that crashes its reader, or needs too much memory"


def say_array(array: np.ndarray) -> None:
    """Write an array to stdout in NumPy's format. ``np.save`` itself writes to no buffered pipe."""
    data = io.BytesIO()
    np.save(data, array, allow_pickle=False)
    sys.stdout.buffer.write(data.getvalue())


def limit(memory: int, seconds: int) -> None:
    """Limit this process, where the operating system can.

    Args:
        memory: largest memory, bytes.
        seconds: processor time.
    """
    with suppress(ImportError, ValueError, OSError):
        import resource

        for kind, most in ((resource.RLIMIT_DATA, memory), (resource.RLIMIT_CPU, seconds)):
            resource.setrlimit(kind, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
