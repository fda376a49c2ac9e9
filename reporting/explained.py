"""A table of the terminal with a title and an explanation of its columns."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.table import Table

_ENDLESS = 10_000  # columns, wider than any table


@dataclass(frozen=True)
class Explained:
    """A table with a title above it, and a text below it that explains its columns.

    Title and text wrap at the width of the terminal; rich would wrap them at that of the table. A
    table that is too wide for the terminal has no blanks beside its cells; if that is not enough,
    it is turned, with a line for each column.
    """

    title: str
    """The line above the table."""
    table: Table
    """The table, without title and caption."""
    text: str
    """What the columns mean."""

    @staticmethod
    def of(
        title: str,
        heads: Sequence[str],
        rows: Iterable[Sequence[str]],
        text: str,
        left: Collection[str] = (),
        bold: Collection[str] = (),
    ) -> "Explained":
        """Return a table of rows.

        Args:
            title: the line above the table.
            heads: heads of the columns.
            rows: cells of each row; the last ones may be left out.
            text: what the columns mean.
            left: heads of the columns that are aligned on the left; the others are on the right.
            bold: first cells of the rows in bold type.
        """
        table = Table()
        for head in heads:
            side: JustifyMethod = "left" if head in left else "right"
            table.add_column(head, justify=side, overflow="fold")
        for row in rows:
            table.add_row(*row, style="bold" if row[0] in bold else None)
        return Explained(title, table, text)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        table, endless = self.table, options.update(width=_ENDLESS)

        def width(table: Table) -> int:
            return table.__rich_measure__(console, endless).maximum

        if width(table) > options.max_width:
            table.padding = (0, 0)
            turned = _turned(table)
            if options.max_width < width(table) and width(turned) < width(table):
                table = turned
        yield from (self.title, table, self.text)


def _turned(table: Table) -> Table:
    """Return the table with its columns as rows; the first column becomes the heads."""
    first, *others = table.columns
    turned = Table()
    turned.add_column(first.header)
    for cell, row in zip(first.cells, table.rows, strict=True):
        turned.add_column(cell, justify="right", overflow="fold", style=row.style or "")
    for column in others:
        turned.add_row(column.header, *column.cells)
    return turned
