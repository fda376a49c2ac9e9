"""Cover of a report: the verdict, what is covered, and what the report is about."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...simulation.safety import DISCLAIMER
from ..pages import escaped, table
from ..text import counted
from .blind_spot_section import blind_sentence
from .facts import Facts
from .verdicts import overall, verdicts

PICTURE = "placement.png"


@dataclass(frozen=True)
class Identity:
    """What tells a report from others."""

    created: str
    """Date and time of the report."""
    revision: str
    """Revision that the user states; may be empty."""
    file_sha256: str
    """SHA-256 of the setup's file; empty for a layout without a file."""
    scene_sha256: str
    """SHA-256 of the scene as it was evaluated, as JSON."""


def heading(f: Facts) -> str:
    """Return the title of the report, as plain text."""
    sensors, rings = counted(f.setup.sensors, "sensor"), counted(len(f.setup.rings), "ring")
    on = f" on {rings}" if f.setup.rings else ""
    return f"Sensor coverage of {f.scene.robot.name} with {sensors}{on}"


def verdict_lines(f: Facts) -> Iterator[str]:
    """Yield the verdict as a Markdown block quote, and its table: a row for each question."""
    each = verdicts(f)
    named = {
        state: ", ".join(one.question for one in each if one.state == state)
        for state in ("pass", "fail", "not known")
    }
    said = "; ".join(f"{state}: {names}" for state, names in named.items() if names)
    yield f"> **{overall(each)}** {said[0].upper()}{said[1:]}.\n"
    rows = [(one.question, f"**{one.state}**", escaped(one.figure)) for one in each]
    yield table(("", "verdict", "figure"), rows)


def cover(f: Facts, identity: Identity, sentence: str, version: str) -> Iterator[str]:
    """Yield the cover's paragraphs, as Markdown, with the break after it.

    Args:
        f: counts of the setup.
        identity: what tells the report from others.
        sentence: coverage of the setup, as Markdown.
        version: version of place-rings.
    """
    yield f"# {escaped(heading(f))}\n"
    yield from verdict_lines(f)
    yield f"{sentence} {' '.join(f'{escaped(blind_sentence(b))}.' for b in f.blind)}\n"
    yield (
        "![The setup from two sides: sensors, beams, and the uncovered part of the"
        f" target]({PICTURE})\n"
    )
    named = identity.file_sha256
    rows = [
        ("Robot", escaped(f.scene.robot.name)),
        ("Setup", escaped(Path(f.name).name) + ("" if named else ", a layout of the paper")),
        ("Date", identity.created),
        ("Revision", escaped(identity.revision) or "not stated (`--revision`)"),
        *([("SHA-256 of the setup's file", f"`{named}`")] if named else []),
        ("SHA-256 of the scene", f"`{identity.scene_sha256}`"),
        ("Program", f"place-rings {escaped(version)}"),
    ]
    yield table(("", ""), rows)
    yield (
        f"{DISCLAIMER} *Covered* compares a proved lower bound of the coverage with the required"
        " value; *wireable* and *powered* follow from the boards' and buses' limits, not from a"
        " test on a bench.\n"
    )
    yield "---\n"
