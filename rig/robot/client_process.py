"""A process in which a client of ur-rtde runs, so that its crash cannot affect the check."""

import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from ..recording.records import Kind, Record


@contextmanager
def client_process(seconds: float) -> Iterator[int]:
    """Yield the file descriptor for records in a process that serves a client, and end the process.

    The client's errors become a note. Python cannot interrupt a constructor that hangs, so the
    kernel ends the process after ``seconds`` unless the block sets another limit. Ctrl-C and a
    terminal that hangs up are left to the check, which commands a stop.
    """
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # the client prints
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield out
    except BrokenPipeError:
        pass  # the check is gone; the robot's watchdog ends its program
    except Exception as error:  # the client may raise anything
        os.write(out, Record(Kind.NOTE, 0, time.monotonic(), complaint(error).encode()).pack())
    os._exit(0)  # the client's threads may hang


def complaint(error: Exception) -> str:
    """Return an error of the client as one line; if ur-rtde is missing, how to install it; if the
    robot has no dashboard server, what works without.
    """
    if isinstance(error, ImportError):
        from ...formats.optional_dependencies import how_to_install  # loads pydantic

        return f"ur-rtde is not installed: {how_to_install('rig')}"
    text = " ".join(str(error).split()) or repr(error)
    if "dashboard server" in text:
        return (
            f"{text} The controller does not answer on port 29999: a robot with PolyScope X has no"
            " dashboard server, so that ur-rtde reads its joints but does not move it; leave out"
            " --move and guide it to its poses"
        )
    return text
