"""Table of a search for the fewest rings: the coverage of each number of rings."""

from rich.table import Table

from ..formats.schema.proposal_models import FewestRingsModel
from ..objectives.prices import Prices
from .explained import Explained
from .text import counted


def fewest_rings_table(record: FewestRingsModel, prices: Prices | None) -> Explained:
    """Return a table with a row for each number of rings; the answer is bold."""
    table = Table()
    heads = ("rings", "coverage", "below the best", *(["price"] if prices else []), "seconds")
    for name in heads:
        table.add_column(name, justify="right")
    best = max(one.exact_percent for one in record.tried)
    answer = next((one.rings for one in record.tried if one.within), None)
    for one in record.tried:
        price = [] if prices is None or one.price is None else [prices.text(one.price)]
        table.add_row(
            str(one.rings),
            f"{one.exact_percent:.2f}",
            f"{best - one.exact_percent:.2f}",
            *price,
            f"{one.seconds:.0f}",
            style="bold" if one.rings == answer else None,
        )
    return Explained(
        "Fewest rings: coverage in percent of the best setup found for each number of rings",
        table,
        "below the best: loss against the best row, in percentage points; seconds: time of the"
        " search for this number of rings.",
    )


def fewest_rings_line(record: FewestRingsModel) -> str:
    """Return the answer of a search for the fewest rings as a sentence."""
    answer = next(one for one in record.tried if one.within)
    best = max(one.exact_percent for one in record.tried)
    fewer = [one for one in record.tried if one.rings == answer.rings - 1]
    loss = "".join(
        f"; {counted(one.rings, 'ring')} lose {best - one.exact_percent:.2f} points"
        for one in fewer
    )
    margin = f"{record.within_points:g} point{'s' * (record.within_points != 1)}"
    return (
        f"The proposal has {counted(answer.rings, 'ring')}, the fewest within {margin} of the best"
        f" found{loss}. All searches took {sum(one.seconds for one in record.tried):.0f} s."
    )
