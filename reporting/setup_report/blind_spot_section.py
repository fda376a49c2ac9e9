"""Section of a report on blind spots: the largest balls that no sensor covers."""

from collections.abc import Iterator

from ...objectives.blind_spots import LEAST, Blind
from ..pages import table
from ..text import listed
from .directions import height, metres, whereabouts
from .facts import Facts


def blind_name(number: int) -> str:
    """Return the file name of the picture of a target's blind spots."""
    return f"blind_{number}.png"


def blind_sentence(blind: Blind) -> str:
    """Return the largest blind spot in one sentence, or that there is none."""
    if not blind.spots:
        return (
            f"No ball of {200 * LEAST:.0f} cm or more across fits into the uncovered part of"
            f" {blind.target}"
        )
    spot = blind.spots[0]
    return (
        f"The largest ball in {blind.target} that no sensor covers is {2 * spot.radius:.2f} m"
        f" across: {whereabouts(spot)}, {height(spot)}"
    )


def blind_spot_section(f: Facts) -> Iterator[str]:
    """Yield the section's paragraphs and tables, as Markdown."""
    yield "## Blind spots\n"
    several = len(f.scene.poses) > 1
    yield (
        "A blind spot is a ball that lies wholly in the target and that no sensor covers: a thing"
        " of that size can be there unnoticed. The balls do not overlap; each is the largest that"
        f" fits beside those before it, right to a few voxels of {100 * f.voxel:g} cm."
        f" Balls less than {200 * LEAST:.0f} cm across are not listed. The front is the side of the"
        " base to which the tool points; left and right are those of the robot. Heights count from"
        " the base frame's origin.\n"
    )
    if f.scene.person is not None:
        yield "Only what a person can touch counts here, by the scene's `person`.\n"
    for n, blind in enumerate(f.blind):
        if len(f.blind) > 1:
            yield f"### {blind.target}\n"
        amounts = [
            f"{f'pose {p}: ' if several else ''}{1000 * v:,.1f} litres"
            for p, v in zip(blind.poses, blind.volume, strict=True)
        ]
        yield f"Uncovered under `{f.scene.occlusion}`: {'; '.join(amounts)}.\n"
        if not blind.spots:
            yield f"{blind_sentence(blind)}.\n"
            continue
        yield (
            f"![The largest uncovered balls of {blind.target} beside the robot, from two"
            f" sides]({blind_name(n)})\n"
        )
        yield table(*_spots(blind, several), right=(0, 1))


def _spots(blind: Blind, several: bool) -> tuple[list[str], list[list[str]]]:
    rows = []
    for i, spot in enumerate(blind.spots):
        gap = spot.beside.gap - spot.radius
        near = "touches it" if gap <= blind.voxel else f"{gap:.2f} m"
        row = [
            str(i + 1),
            f"{2 * spot.radius:.2f}",
            whereabouts(spot),
            height(spot),
            near,
        ]
        row += [metres(spot.centre)]
        rows.append(row + ([listed([str(p) for p in spot.poses])] if several else []))
    heads = ["", "diameter, m", "where", "height", "gap to the robot", "centre x, y, z, m"]
    return heads + (["in poses"] if several else []), rows
