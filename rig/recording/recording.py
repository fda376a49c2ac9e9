"""Recording of a check: all received data with arrival times, in a file that stays readable if the
process is killed.
"""

import errno
import json
import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...coverage.definitions.errors import UserError
from ..closing import Closing
from .records import DamagedError, Kind, Record, RecordReader

FORMAT = "place-rings rig 1"
# s between flushes to the disk: a loss of power may cost this much, a killed process nothing
_SYNC = 1.0
_CHUNK = 1 << 20
_LAST = 1e11  # s since 1970, latest plausible time


class Recording(Closing):
    """Appends records to a new file; when ``put`` returns, the operating system has the record.

    If the disk is full, or writing fails for another reason, the recording ends at the last
    complete record. ``failure`` then gives the reason, and later records are discarded.

    Args:
        path: of the file, which must not exist.
        about: description of the recorded check, as JSON.

    Raises:
        UserError: if the file exists or cannot be created.
    """

    def __init__(
        self,
        path: Path,
        about: Mapping[str, Any],
    ) -> None:
        self.path, self.failure = path, ""
        self._lock, self._size, self._ended = threading.Lock(), 0, threading.Event()
        try:
            self._file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_APPEND, 0o644)
        except OSError as error:
            raise UserError(f"{path}: cannot be recorded to: {error.strerror}") from error
        self.wall = time.time()
        """Start of the recording, s since 1970."""
        what = {"format": FORMAT, "wall": self.wall, **about}
        self.put(Record(Kind.ABOUT, 0, time.monotonic(), json.dumps(what).encode()))
        self._thread = threading.Thread(target=self._sync, name="recording", daemon=True)
        self._thread.start()

    def put(self, record: Record) -> None:
        """Store a record."""
        data = record.pack()
        with self._lock:
            if self.failure or self._file < 0:
                return
            try:
                left = data
                while left:
                    left = left[os.write(self._file, left) :]
                self._size += len(data)
            except OSError as error:
                self._fail(error)

    def close(self) -> None:
        """Write an end mark, which tells a reader that nothing is missing."""
        self.put(Record(Kind.END, 0, time.monotonic()))
        self._ended.set()
        self._thread.join()
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
                self._file = -1

    def _fail(self, error: OSError) -> None:
        """Cut the file after its last complete record, if possible; a reader skips the
        rest anyway.
        """
        self.failure = self.failure or f"{self.path}: the recording ended: {error.strerror}"
        with suppress(OSError):
            os.ftruncate(self._file, self._size)

    def _sync(self) -> None:
        """Flush to the disk now and then, in a thread of its own, so that callers of ``put`` never
        wait.
        """
        while True:
            ended = self._ended.wait(_SYNC)
            try:
                os.fsync(self._file)
            except OSError as error:
                # a pipe or a device cannot be flushed
                if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                    with self._lock:
                        self._fail(error)
                    return
            if ended:
                return


class RecordingReader:
    """Reads a recording.

    ``about`` describes the recorded check. ``ended`` says whether the end mark was read. ``damage``
    gives the reason if the file could not be read to its end, and is empty otherwise.
    """

    def __init__(self, path: Path) -> None:
        self._path, self.ended, self.damage = path, False, ""
        first = next(self.records(), None)
        self._began = 0.0 if first is None else first.time
        try:
            self.about: dict[str, Any] = (
                json.loads(first.data) if first and first.kind == Kind.ABOUT else {}
            )
        except ValueError:
            self.about = {}
        if not isinstance(self.about, dict) or self.about.get("format") != FORMAT:
            raise UserError(
                f"{path}: not a recording of a rig; give a file that `place-rings check` recorded"
            )
        self.ended, self.damage = False, ""

    @property
    def wall(self) -> float:
        """Start of the recording, s since 1970; 0 if unknown."""
        wall = self.about.get("wall")
        return wall if isinstance(wall, float) and 0 <= wall < _LAST else 0.0

    @property
    def epoch(self) -> float:
        """Time 0 of the recording's clock, s since 1970; 0 if unknown."""
        return self.wall - self._began if self.wall else 0.0

    def records(self) -> Iterator[Record]:
        """Iterate over the records, up to the end or the first damage.

        Raises:
            UserError: if the file cannot be read.
        """
        reader = RecordReader()
        try:
            with self._path.open("rb") as file:
                while True:
                    data = file.read(_CHUNK)
                    try:
                        found = reader.feed(data)
                    except DamagedError as error:
                        self.damage = str(error)
                        return
                    self.ended = self.ended or any(record.kind == Kind.END for record in found)
                    yield from found
                    if not data and not found:
                        break
        except OSError as error:
            raise UserError(f"{self._path}: cannot be read: {error.strerror}") from error
        if reader.left:
            self.damage = f"the last {reader.left} bytes are an incomplete record"
