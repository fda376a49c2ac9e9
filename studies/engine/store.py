"""Finished cells of a study, kept in an SQLite file, so that a study that was stopped goes on where
it was.

A cell is one measurement: the name of a work and its arguments, both of which JSON can hold. Each
is stored at once when it is finished; a kill loses only what was being measured. One process at a
time has the file: the lock is the database's own, so that it ends with the process, however that
ends.
"""

import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from ...formats.errors import UserError

_FORM = 1  # of the table; a file of another form is refused


@dataclass(frozen=True)
class Cell:
    """One measurement: ``work`` names a function, ``arguments`` (JSON) is what it is called
    with.
    """

    work: str
    arguments: Mapping[str, Any]

    @property
    def key(self) -> str:
        """The cell as a line of JSON, the same for the same measurement."""
        return json.dumps([self.work, self.arguments], sort_keys=True, separators=(",", ":"))


class Store:
    """A file of results by cell, and by the version of the program that measured them."""

    def __init__(self, file: Path, version: str | Mapping[str, str]) -> None:
        """Open or make ``file``, and keep others out of it.

        Args:
            file: the database.
            version: of the program, for all cells or by work; what another version measured is
                measured again.

        Raises:
            UserError: if it is not such a file, or another process has it.
        """
        self.file, self._version = file, version
        try:
            self._base = sqlite3.connect(file, timeout=1.0, isolation_level=None)
            self._base.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._base.execute("BEGIN EXCLUSIVE")
            self._base.execute("COMMIT")  # the lock stays
            form = self._base.execute("PRAGMA user_version").fetchone()[0]
            tables = self._base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
            if form != _FORM and tables:
                raise UserError(
                    f"{file}: found a database of form {form}, allowed: form {_FORM}, or no file"
                )
            self._base.execute(
                "CREATE TABLE IF NOT EXISTS cells (key TEXT, version TEXT, result TEXT NOT NULL,"
                " seconds REAL NOT NULL, PRIMARY KEY (key, version))"
            )
            self._base.execute(f"PRAGMA user_version = {_FORM}")
        except sqlite3.Error as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                raise UserError(
                    f"{file}: found another study running into this folder, allowed: one at a time"
                ) from error
            raise UserError(
                f"{file}: found a file that is no database of cells ({error}), allowed: one, or no"
                " file"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._base.close()

    def get(self, cell: Cell) -> Any:
        """The result of a cell, as JSON gives it back; None where there is none."""
        question = "SELECT result FROM cells WHERE key = ? AND version = ?"
        found = self._base.execute(question, (cell.key, self._of(cell))).fetchone()
        return json.loads(found[0]) if found else None

    def put(self, cell: Cell, result: object, seconds: float) -> None:
        """Keep the result of a cell; where there is one already, that one stays."""
        text = json.dumps(result, allow_nan=False)
        self._base.execute(
            "INSERT OR IGNORE INTO cells VALUES (?, ?, ?, ?)",
            (cell.key, self._of(cell), text, seconds),
        )

    def _of(self, cell: Cell) -> str:
        """The version of the program that measures a cell."""
        return self._version if isinstance(self._version, str) else self._version[cell.work]
