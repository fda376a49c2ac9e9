"""Page of the study of layouts: tables, a figure, the sources, and how to add a layout."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from ...reporting.pages import csv_text, escaped, table
from ..engine.setups_file import FILE, HOW, setups_toml
from .figure import picture
from .study import TARGETS, VOXEL, WIDTH, ScoredLayout, beam

_NAMES = [str(target) for target in TARGETS]
_LEFT_OUT = (
    (
        "ProxySKIN (Sensors 2024, 24(4), 1334; UR10e)",
        "the text states how many sensors an array has (ten VL53L8CX) and how many arrays suit a"
        " link (three), but not where on the arm they are",
    ),
    (
        "The seven strips that Woomessi's authors chose on a Panda",
        "their frames are in .mat files that were not at hand; the docs show the layout file that"
        " reads them from a copy of the repository",
    ),
)


FILES = ("README.md", "data.csv", "layouts.png", FILE)


def write(rows: Sequence[ScoredLayout], folder: Path) -> dict[str, str]:
    """Draw the figure into ``folder`` and return the texts of the other files by name."""
    picture(rows, folder / "layouts.png")
    found = {
        row.layout.name: (row.proposal["rings"], row.scene)
        for row in rows
        if isinstance(row.scene.get("robot", ""), str)  # a built-in robot, by its name
    }
    return {
        "data.csv": csv_text([one for row in rows for one in _records(row)]),
        "README.md": "\n".join(_page(rows)),
        FILE: setups_toml(found),
    }


def _records(row: ScoredLayout) -> Iterator[dict[str, object]]:
    for who, score in (("layout", row.score), ("search", row.proposed)):
        for name in _NAMES:
            yield {
                "layout": row.layout.name,
                "robot": row.layout.scene.robot.name,
                "sensors": row.sensors,
                "setup": who,
                "target": name,
                "ignore_percent": score.ignore[name],
                "shadow_percent": score.shadow[name],
                "low_percent": score.low[name],
                "high_percent": score.high[name],
            }


def _page(rows: Sequence[ScoredLayout]) -> Iterator[str]:
    yield "# Layouts of sensors, scored under the same rules\n"
    yield (
        "Published layouts of on-robot sensors, each counted on its own robot in one pose: the"
        " share ζ of each target volume that at least one sensor covers, with self-occlusion"
        " (`shadow`: points behind the robot's body are not covered) and without (`ignore`). Counts"
        f" have voxels of {100 * VOXEL:g} cm (rule `centre`). `data.csv` has them, and an interval"
        f" that is guaranteed to hold ζ under `shadow` (rule `certified`, {100 * WIDTH:g} points"
        " wide). Beside each layout stands what the search proposes with as many sensors of the"
        " same kind, in rings that can be mounted on the same robot.\n"
    )
    yield (
        "V_S(r) is the discs of r metres across the arm's centre line, cut flat at both ends, less"
        " those of 0.15 m; V_OT is the sphere of the robot's reach and the sphere of 1.5 m about"
        " the tool. Robots, beams and numbers of sensors differ, so rows compare with the search"
        " beside them, not with each other. The search may choose any link for its rings; a layout"
        " on one link was not made for the whole arm.\n"
    )
    yield "![Each layout on its robot, with its coverage beside the search's](layouts.png)\n"
    yield "## Layouts and the search, under shadow\n"
    yield (
        "ζ in percent: layout → search, and the difference in points in brackets. The search"
        " maximises the mean of the four targets.\n"
    )
    heads = ("layout", "robot", "sensors", "beam", *_NAMES)
    yield table(heads, map(_compared, rows), right=(2,))
    if any(row.layout.incomplete for row in rows):
        yield "† A part of the robot's body is missing; the source below names it.\n"
    yield _verdict(rows)
    yield "## Without self-occlusion\n"
    yield "As above, with beams that pass through the robot (`ignore`).\n"
    yield table(
        ("layout", *_NAMES),
        ([_name(row), *_pairs(row.score.ignore, row.proposed.ignore)] for row in rows),
    )
    yield from _sources(rows)
    yield "[Score a layout of sensors](../../docs/layouts.md) says how to add a layout.\n"
    yield "## Setups\n"
    yield (
        f"`{FILE}` has what the search proposes beside each layout on a built-in robot, by the"
        " layout's name.\n"
    )
    yield HOW
    yield _effort(rows)


def _verdict(rows: Sequence[ScoredLayout]) -> str:
    """Return how often the search covers more, where the guaranteed intervals decide it."""
    more = [sum(row.proposed.low[n] > row.score.high[n] for row in rows) for n in _NAMES]
    less = [sum(row.proposed.high[n] < row.score.low[n] for row in rows) for n in _NAMES]
    each = ", ".join(
        f"of {name} on {a} and less on {b}" for name, a, b in zip(_NAMES, more, less, strict=True)
    )
    return (
        f"Of {len(rows)} layouts, the search covers provably more {each}; for the others the"
        " guaranteed intervals overlap.\n"
    )


def _name(row: ScoredLayout) -> str:
    return f"`{row.layout.name}`" + " †" * row.layout.incomplete


def _compared(row: ScoredLayout) -> list[str]:
    head = [
        _name(row),
        row.layout.scene.robot.name,
        f"{row.sensors}",
        beam(row.layout.scene.sensor),
    ]
    return [*head, *_pairs(row.score.shadow, row.proposed.shadow)]


def _pairs(of: object, other: object) -> list[str]:
    mine, theirs = dict(of), dict(other)  # type: ignore[call-overload]
    return [
        f"{mine[name]:.1f} → {theirs[name]:.1f} ({round(theirs[name] - mine[name], 1) + 0.0:+.1f})"
        for name in _NAMES
    ]


def _sources(rows: Sequence[ScoredLayout]) -> Iterator[str]:
    yield "## Sources\n"
    yield (
        "Poses are facts, as far as the sources publish them. A sensor that lies in the robot's"
        " body, because bodies are capsules about the links or because a pad lies flush in its"
        " skin, is moved along its axis to the surface; the distance is stated here.\n"
    )
    for row in rows:
        about = row.layout.about
        yield f"### `{row.layout.name}`: {escaped(about.title)}\n"
        yield f"- source: {escaped(about.source)}; read {about.date}"
        yield f"- licence: {escaped(about.licence)}"
        yield f"- poses: {escaped(about.how)}"
        yield f"- beam: {beam(row.layout.scene.sensor)}; {escaped(about.beam_source)}"
        yield f"- {_lifted(row)}"
        for note in filter(None, (about.note, *row.layout.notes)):
            yield f"- {escaped(note)}"
        yield ""
    yield "### Not scored\n"
    for title, reason in _LEFT_OUT:
        yield f"- {title}: {reason}."
    yield ""


def _lifted(row: ScoredLayout) -> str:
    """Return a sentence about the sensors that lay in a body, and those that see nothing."""
    moved = [lift for lift in row.layout.lifts if lift.lifted]
    stays = len(row.layout.lifts) - len(moved)
    text = "no sensor lies in the body of its own link"
    if moved:
        most = 1000 * max(lift.distance for lift in moved)
        text = f"{len(moved)} of {row.sensors} sensors lifted to the surface, by {most:.1f} mm at"
        text += " most"
    if stays:
        text += f"; {stays} lie deeper than {row.layout.about.lift_mm:g} mm and stay"
    return text + f"; {row.unseeing} of {row.sensors} see less than 1 % of their beams in this pose"


def _effort(rows: Sequence[ScoredLayout]) -> str:
    """Return how long the searches took, and which of them the limit cut short."""
    processor = sum(row.processor_seconds for row in rows)
    wall = sum(row.wall_seconds for row in rows)
    cut = ", ".join(f"`{row.layout.name}`" for row in rows if not row.finished)
    end = (
        f"Cut short by the limit: {cut}. A longer search usually finds better setups, so these are"
        " lower ends of what it can reach."
        if cut
        else "All of them completed."
    )
    return (
        f"Each search may use {rows[0].limit_seconds:g} s of processor time, besides the count of"
        f" its result. Those of this page used {processor:.0f} s of processor time in {wall:.0f} s,"
        f" so they had {processor / wall:.1f} processors to themselves. {end}\n"
    )
