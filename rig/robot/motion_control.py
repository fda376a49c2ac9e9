"""The check's end of the process that moves the robot: its commands and its answers."""

import os
import select
import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress

from ..recording.records import DamagedError, Kind, Record, RecordReader

_ENDING = 0.5  # s until a process that reads no more has ended


class NoAnswerError(Exception):
    """The process that moves the robot did not follow a command."""


class MotionControl:
    """Starts the process, which then reports that it is ready.

    Args:
        command: the process and its arguments.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self.heard = time.monotonic()
        """Time of the last answer, s."""
        self._reader = RecordReader()
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )

    def kill(self) -> None:
        """End the process at once; the robot's watchdog then ends its program."""
        self._process.kill()

    def close(self, seconds: float) -> None:
        """End the process; it has ``seconds`` to stop the robot."""
        if self._process.poll() is None and self._process.stdin:
            self._process.stdin.close()  # the process then stops the robot and ends
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)
        self._process.kill()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()
        self._process.wait()

    def tell(self, kind: Kind, data: bytes = b"") -> None:
        """Send a command; raise NoAnswerError if the process has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(Record(kind, 0, time.monotonic(), data).pack())
        except (OSError, ValueError):
            status = None
            with suppress(subprocess.TimeoutExpired):
                status = self._process.wait(_ENDING)
            raise NoAnswerError(
                "the client's process ended" if status is None else _ended_by(status)
            ) from None

    def expect(self, word: str, seconds: float) -> None:
        """Wait until the process answers ``word``."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if word in self.hear(left):
                return
        raise NoAnswerError("no answer in time")

    def hear(self, seconds: float) -> list[str]:
        """Return the answers of the process, waiting at most ``seconds``; raise its complaint, if
        any.
        """
        pipe = self._process.stdout
        assert pipe is not None
        if not select.select([pipe], [], [], seconds)[0]:
            return []
        if not (data := os.read(pipe.fileno(), 1 << 12)):
            raise NoAnswerError(_ended_by(self._process.wait()))
        self.heard = time.monotonic()
        try:
            records = self._reader.feed(data)
        except DamagedError as error:
            raise NoAnswerError(str(error)) from None
        words = [record.data.decode(errors="replace") for record in records]
        for record, text in zip(records, words, strict=True):
            if record.kind == Kind.NOTE:
                raise NoAnswerError(text)
        return words


def _ended_by(status: int) -> str:
    """Describe how the client's process ended, by its exit status."""
    if status == -signal.SIGALRM:
        return "the client hung, and its process was ended"
    return f"the client's process ended by {signal.Signals(-status).name if status < 0 else status}"
