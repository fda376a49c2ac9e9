"""Finished cells of a study in an SQLite file, so that an interrupted study resumes.

A cell is one measurement: the name of a task and its arguments, both JSON data. Each result is
stored at once; a kill loses only the current measurement. One process at a time holds the file by
the database's own lock, which ends with the process in every case.
"""

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from ...coverage.definitions.errors import UserError

_UNWRITABLE = (
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_CANTOPEN,
)
_FORM = 1  # version of the table; files of other versions are rejected


@dataclass(frozen=True)
class Cell:
    """One measurement."""

    work: str
    """Name of the task's function."""
    arguments: Mapping[str, Any]
    """Arguments of the function, as JSON data."""

    @property
    def key(self) -> str:
        """The cell as a line of JSON, unique for the measurement."""
        return json.dumps([self.work, self.arguments], sort_keys=True, separators=(",", ":"))


Measure = Callable[[str, list[Cell]], list[Any]]
"""Measures cells under a heading."""


class Store:
    """A file of results by cell and by the version of the package that measured them."""

    def __init__(self, file: Path, version: str) -> None:
        """Open or create the file and lock it.

        Args:
            file: the database.
            version: version of the package; results of other versions are measured again.

        Raises:
            UserError: if the file is no such database, cannot be written, or another process holds
                it.
        """
        self.file, self._version = file, version
        self.measured = 0
        with self._errors_named():
            self._base = sqlite3.connect(file, timeout=1.0, isolation_level=None)
        try:
            with self._errors_named():
                self._begin()
        except BaseException:
            self._base.close()
            raise

    def _begin(self) -> None:
        """Lock the file, and make the table if it is new."""
        self._base.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._base.execute("BEGIN EXCLUSIVE")
        self._base.execute("COMMIT")  # the lock stays
        form = self._base.execute("PRAGMA user_version").fetchone()[0]
        tables = self._base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if form != _FORM and tables:
            raise UserError(
                f"{self.file}: found a database of form {form}, allowed: form {_FORM}, or no file"
            )
        self._base.execute(
            "CREATE TABLE IF NOT EXISTS cells (key TEXT, version TEXT, result TEXT NOT NULL,"
            " seconds REAL NOT NULL, PRIMARY KEY (key, version))"
        )
        self._base.execute(f"PRAGMA user_version = {_FORM}")

    @contextmanager
    def _errors_named(self) -> Iterator[None]:
        """Raise UserError, with the file and the reason, where the database fails."""
        try:
            yield
        except sqlite3.Error as error:
            code = error.sqlite_errorcode & 0xFF  # without the details of an extended code
            if code == sqlite3.SQLITE_BUSY:
                line = "another study is running in this folder; wait for it, or choose another"
            elif code in _UNWRITABLE:
                line = f"cannot be written: {error}; what was measured before is kept"
            else:
                line = f"found a file that is no database of cells ({error}), allowed: one, or none"
            raise UserError(f"{self.file}: {line}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._base.close()

    def get(self, cell: Cell) -> Any:
        """Return the result of a cell as JSON data, or None."""
        question = "SELECT result FROM cells WHERE key = ? AND version = ?"
        with self._errors_named():
            found = self._base.execute(question, (cell.key, self._version)).fetchone()
        return json.loads(found[0]) if found else None

    def put(self, cell: Cell, result: object, seconds: float) -> None:
        """Store the result of a cell, unless there is one already, and count it in ``measured``."""
        text = json.dumps(result, allow_nan=False)
        with self._errors_named():
            self.measured += self._base.execute(
                "INSERT OR IGNORE INTO cells VALUES (?, ?, ?, ?)",
                (cell.key, self._version, text, seconds),
            ).rowcount

    def means(self, kind: Callable[[Cell], str]) -> dict[str, float]:
        """Return the mean time in seconds of the cells of each kind, of all versions."""
        seconds: dict[str, list[float]] = {}
        with self._errors_named():
            rows = self._base.execute("SELECT key, seconds FROM cells").fetchall()
        for key, spent in rows:
            seconds.setdefault(kind(Cell(*json.loads(key))), []).append(spent)
        return {name: sum(each) / len(each) for name, each in seconds.items()}
