"""Report of a setup as Markdown."""

from collections.abc import Iterator, Mapping, Sequence

from ...coverage.rings.sensor_records import sensor_records
from ...simulation.safety import DISCLAIMER
from ..lines.occlusion import ADVICE
from ..lines.results import sensor_lines
from ..pages import code, escaped
from ..text import counted
from .bill_of_materials import materials
from .blind_spot_section import blind_spot_section
from .cable_section import cable_section
from .cover import Identity, cover
from .coverage_section import answer, coverage_section, robustness_section, separation_section
from .definition_section import definition_section
from .facts import Facts
from .mounting_guide import mounting
from .reproduction_section import reproduction_section
from .scene_section import scene_section


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
        separation_section(f),
        robustness_section(f),
    )
    lines = [line for part in parts for line in part]
    lines += ["## Mounting", "", *mounting(f.scene, f.setup, f.sensitivity), *_faults(f)]
    lines += cable_section(f.scene, f.setup)
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
