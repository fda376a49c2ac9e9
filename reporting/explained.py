"""A table of the terminal with a title and an explanation of its columns."""

from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table

_ENDLESS = 10_000  # columns, wider than any table


@dataclass(frozen=True)
class Explained:
    """A table with a title above it, and a text below it that explains its columns.

    Title and text wrap at the width of the terminal; rich would wrap them at that of the table. A
    table that is too wide for the terminal has no blanks beside its cells.
    """

    title: str
    """The line above the table."""
    table: Table
    """The table, without title and caption."""
    text: str
    """What the columns mean."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        wanted = self.table.__rich_measure__(console, options.update(width=_ENDLESS)).maximum
        self.table.padding = (0, 0) if wanted > options.max_width else (0, 1)
        yield from (self.title, self.table, self.text)
