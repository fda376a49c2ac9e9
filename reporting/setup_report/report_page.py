"""Report of a setup as Markdown."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...coverage.rings.sensor_records import sensor_records
from ...simulation.safety import DISCLAIMER
from ..lines.occlusion import ADVICE
from ..lines.results import sensor_lines
from ..pages import code, command, command_of, escaped, table
from ..text import counted
from .bill_of_materials import materials
from .blind_spot_section import blind_sentence, blind_spot_section
from .cable_section import cable_section
from .coverage_section import answer, coverage_section, robustness_section, separation_section
from .detection_section import detection_section
from .facts import Facts
from .firing_section import firing_section
from .mounting_guide import mounting
from .scene_section import definition_section, scene_section
from .smallest_object_section import smallest_object_section
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


# options of the report that verify does not take, and flags without a value
_ASKED = (
    "--target",
    "--radius",
    "--draws",
    "--seed",
    "--voxel",
    "--out",
    "--require",
    "--revision",
    "--rod-length",
)
_FLAGS = ("--pdf", "--json", "--smallest-object")


def _listed_versions(versions: Mapping[str, str]) -> str:
    return escaped(", ".join(f"{name} {number}" for name, number in versions.items()))


def reproduction_section(
    f: Facts, words: Sequence[str], versions: Mapping[str, str]
) -> Iterator[str]:
    """Yield the commands of the search, of this report, and of a proof of ζ.

    Args:
        f: counts of the setup.
        words: words of this report's command line.
        versions: versions of the programs.
    """
    yield "## Reproduce\n"
    if f.found is not None:
        yield f"The placement was found {escaped(f.found.created)} with seed {f.found.seed} in"
        yield f"{f.found.seconds:.0f} s ({escaped(f.found.outcome)}), by"
        yield f"{_listed_versions(f.found.versions)}:\n"
        yield command_of(f.found.command)
        if f.found.bound is not None:
            reached, bound = 100 * f.found.exact, 100 * f.found.bound
            yield "No layout within the budget and the rules of that search reaches more than"
            yield f"{bound:.2f} %; its answer reached {reached:.2f} %.\n"
    yield f"This report, with seed {f.options.seed} for its random draws, was created by"
    yield f"{_listed_versions(versions)}:\n"
    yield command(["place-rings", *words])
    yield "To prove a ζ, as a guaranteed interval:\n"
    target, say = f.scene.targets[0].target, ["place-rings", "verify"]
    if target.plain:
        name, r = target.key
        stated = name if r is None else f"{name}:{r:g}"
        say += [*_without(words[1:], _ASKED), "--target", stated]
    else:
        say += _without(words[1:], _ASKED[2:])
    yield command([*say, "--rule", "certified"])


def _without(words: Sequence[str], options: Collection[str]) -> Iterator[str]:
    """Yield the words of a command line without the given options and their values."""
    left = iter(words)
    for word in left:
        option, together, _ = word.partition("=")
        if option in _FLAGS:
            continue
        if option not in options:
            yield word
        elif not together:
            next(left, None)


def page(
    f: Facts,
    words: Sequence[str],
    versions: Mapping[str, str],
    identity: Identity,
) -> str:
    """Return the whole report.

    Args:
        f: counts of the setup.
        words: words of the command line.
        versions: versions of the programs.
        identity: what tells the report from others.
    """
    parts = (
        cover(f, identity, answer(f), versions["place-rings"]),
        definition_section(f),
        scene_section(f),
        blind_spot_section(f),
        coverage_section(f),
        smallest_object_section(f),
        detection_section(f),
        separation_section(f),
        robustness_section(f),
    )
    lines = [line for part in parts for line in part]
    lines += ["## Mounting", "", *mounting(f.scene, f.setup, f.sensitivity), *_faults(f)]
    lines += [*cable_section(f.scene, f.setup), *firing_section(f.firing)]
    lines += [
        "## Bill of materials",
        "",
        *materials(f.scene, f.setup),
        *_effective(f),
    ]
    lines += [*reproduction_section(f, words, versions), *_limits(f)]
    return "\n".join(lines) + "\n"


def _faults(f: Facts) -> Iterator[str]:
    if f.broken:
        yield "Violated rules of the scene or of a real mount:\n"
        yield "\n".join(f"- {escaped(one.text)}" for one in f.broken) + "\n"


def _effective(f: Facts) -> Iterator[str]:
    if told := sensor_lines(sensor_records(f.setup)):
        yield code("\n".join(told))


def _limits(f: Facts) -> Iterator[str]:
    yield "## Limits\n"
    yield f"- {DISCLAIMER}"
    yield (
        "- Coverage is geometry: the share of a volume inside the sensors' nominal beams. A sensor"
        " sees a small or dark"
    )
    yield "  object in strong light less far."
    if f.scene.robot.bodies:
        yield f"- {ADVICE}"
    yield (
        "- The model contains the robot's capsules and the obstacles' convex hulls, but no cables"
        " or holders."
    )
    yield "- Only the poses of the scene are evaluated, not the motion between them."
    yield (
        f"- Blind spots are made of voxels of {f.voxel:g} m: a covered sheet thinner than that"
        " does not separate them."
    )
    mountings = counted(f.robust[0].errors.draws, "drawn mounting")
    yield (
        f"- The figures under mounting errors have the Monte Carlo error of {mountings}; all"
        " others are counts of voxels.\n"
    )
