"""Section of a report on blind spots."""

from collections.abc import Iterator

from ...objectives.blind_spots import Blind
from ..pages import table
from ..text import counted
from .directions import beside, metres
from .facts import Facts

LEAST = 1e-4  # m³: smaller blind spots are not listed


def blind_name(number: int) -> str:
    """Return the file name of the picture of a target's blind spots."""
    return f"blind_{number}.png"


def listed_spots(blind: Blind) -> int:
    """Return the number of blind spots that are large enough to list."""
    return sum(spot.volume >= LEAST for spot in blind.spots)


def blind_spot_section(f: Facts) -> Iterator[str]:
    """Yield the section's paragraphs and tables, as Markdown."""
    yield "## Blind spots\n"
    several = len(f.scene.poses) > 1
    for n, blind in enumerate(f.blind):
        shown = listed_spots(blind)
        yield f"### {blind.target}\n"
        at = zip(blind.poses, blind.volume, blind.pieces, strict=True)
        amounts = [
            f"{f'pose {p}: ' if several else ''}{1000 * v:,.1f} litres in {counted(k, 'piece')}"
            for p, v, k in at
        ]
        yield (
            f"Uncovered under `{f.scene.occlusion}`: {'; '.join(amounts)}. Voxels that share a"
            " face belong to one piece."
        )
        if not shown:
            yield "All are smaller than 0.1 litre.\n"
            continue
        yield (
            "Pieces of at least 0.1 litre, largest first, in the base"
            f" frame{', each listed once' if several else ''}:\n"
        )
        yield table(*_spots(blind, shown, several), right=(0, 1))
        yield (
            f"![The largest uncovered pieces of {blind.target} beside the robot, from two"
            f" sides]({blind_name(n)})\n"
        )


def _spots(blind: Blind, shown: int, several: bool) -> tuple[list[str], list[list[str]]]:
    rows = []
    for i, spot in enumerate(blind.spots[:shown]):
        near = spot.beside
        gap = "–" if near is None else "none" if near.gap <= blind.voxel else f"{near.gap:.2f} m"
        row = [str(i + 1), f"{1000 * spot.volume:,.1f}", beside(near) or "–", gap]
        row += [metres(spot.centre), " × ".join(f"{v:.2f}" for v in spot.high - spot.low)]
        rows.append(row + ([", ".join(str(p) for p in spot.poses)] if several else []))
    heads = ["", "litres", "where", "gap to the robot", "centre x, y, z, m", "extent x × y × z, m"]
    return heads + (["in poses"] if several else []), rows
