"""Table of a search for the fewest rings: the coverage of each number of rings."""

from collections.abc import Sequence

from ..objectives.prices import Prices
from ..placement.search.result import FewestRings, RingsTried
from .explained import Explained
from .text import counted, listed


def fewest_rings_table(record: FewestRings, prices: Prices | None) -> Explained:
    """Return a table with a row for each number of rings; the answer is bold."""
    best = max(tried.exact for tried in record.tried)
    answer = next((str(tried.rings) for tried in record.tried if tried.within), "")
    rows = [
        (
            str(tried.rings),
            f"{100 * tried.exact:.2f}",
            f"{100 * (best - tried.exact):.2f}",
            *([] if prices is None or tried.price is None else [prices.text(tried.price)]),
            f"{tried.seconds:.0f}",
            "complete" if tried.finished else "cut short",
        )
        for tried in record.tried
    ]
    price = ["price"] if prices else []
    return Explained.of(
        "Fewest rings: coverage in percent of the best setup found for each number of rings",
        ("rings", "coverage", "below the best", *price, "seconds", "search"),
        rows,
        "below the best: loss against the best row, in percentage points; seconds: time of the"
        " search for this number of rings; search: whether it ended by itself.",
        bold=(answer,),
    )


def fewest_rings_line(record: FewestRings) -> str:
    """Return the answer of a search for the fewest rings as a sentence."""
    answer = next(one for one in record.tried if one.within)
    best = max(one.exact for one in record.tried)
    fewer = next((one for one in record.tried if one.rings == answer.rings - 1), None)
    rings = counted(answer.rings, "ring")
    points = round(100 * record.within, 9)
    margin = f"{points:g} point{'s' * (points != 1)} of the best found"
    spent = f"All searches took {sum(one.seconds for one in record.tried):.0f} s."
    if record.conclusive:
        loss = "" if fewer is None else f"; {_loss(fewer, best)}"
        return f"The proposal has {rings}, the fewest within {margin}{loss}. {spent}"
    cut = [one.rings for one in record.tried if not one.finished]
    why = " and ".join(
        [f"a limit cut short the searches with {_rings(cut)}"] * bool(cut)
        + [f"no time was left for {_rings(record.untried)}"] * bool(record.untried)
    )
    loss = "" if fewer is None else f" ({_loss(fewer, best)})"
    return (
        f"The proposal has {rings}, within {margin} so far{loss}. Another number may be better:"
        f" {why}. Set a longer --time, or none. {spent}"
    )


def _rings(numbers: Sequence[int]) -> str:
    return f"{listed([str(number) for number in numbers])} ring{'s' * ([*numbers] != [1])}"


def _loss(one: RingsTried, best: float) -> str:
    return f"{counted(one.rings, 'ring')} lose {100 * (best - one.exact):.2f} points"
