"""Page of the reproduced paper: statements and verdicts, tables, figures, and open choices."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...reporting import distance_figures
from ...reporting.pages import csv_text, table
from ...simulation.distance import THINGS, summary
from ..engine.scenes import PAPERS_WORLD
from . import distance_cells as paper_distance
from . import figures
from .cone_volume import PLACES, cone_volumes
from .coverage_cells import CHAINS, COUNTS, FAR, NEAR, SETUPS, TARGETS, CoverageRow
from .coverage_statements import coverage
from .figures import COUNT_NAMES, value
from .open_choices import SETUPS as OPEN_SETUPS
from .open_choices import TARGETS as OPEN_TARGETS
from .statements import Statement
from .study import Findings

_SCALES, _DIGITS = (1, 1, 1, 1, 100, 1), (3, 2, 2, 2, 0, 2)

CHOICES = (
    (
        "robot",
        (
            "UR10 (CB3), both by its public URDF (`ur10`) and by its Denavit–Hartenberg table"
            " (`ur10_dh`)"
        ),
    ),
    (
        "pose",
        "the pose of the highest TCP speed in the task below; the paper does not state its pose",
    ),
    (
        "task",
        (
            "ten products in two rows of five at 0.98 and 1.10 m, between tables at -90° and +90°;"
            " joint speeds 120°/s (base, shoulder) and 180°/s, accelerations 80°/s²; each move from"
            " rest to rest with trapezoidal speed"
        ),
    ),
    ("rings", "radius 8 cm, phase 0, at 0, 0.5 and 1 of the link; the tool's at the flange"),
    ("pose curve", "bends blended over half of the adjacent segments, 20 points per bend"),
    (
        "voxel",
        (
            "1 cm by rule `centre` (unbiased); 10 cm by rule `touch`, probed at every quarter of"
            " a side including the faces"
        ),
    ),
)


def write(findings: Findings, folder: Path) -> dict[str, str]:
    """Draw the figures into ``folder`` and return the texts of the other files by name."""
    f = findings
    figures.coverage(f.configurations, f.tilts, folder / "coverage.png")
    distance_figures.errors(f.distances, folder / "distance.png")
    statements = [*coverage(f.configurations, f.tilts), paper_distance.statement(f.distances)]
    rows = [*f.configurations, *f.tilts, *f.cycle, *f.open]
    return {
        "data.csv": csv_text([vars(row) for row in rows]),
        "README.md": "\n".join(_page(f, statements)),
    }


def _page(f: Findings, statements: Sequence[Statement]) -> Iterator[str]:
    yield "# The paper, reproduced\n"
    yield (
        "The paper is Kumar and Sahin, *Sensing Volume Coverage of Robot Workspace using On-Robot"
        " Time-of-Flight Sensor Arrays* (IEEE SMC 2019). The pose is that of the highest TCP speed"
        " in the paper's task, not the pose of the README, so figures differ slightly. Every count"
        f" of coverage is in `data.csv`. {PAPERS_WORLD}\n"
    )
    yield "## The paper's statements and our measurements\n"
    yield (
        "Every statement on coverage is tested in four ways: on both UR10 chains, each counted"
        " without bias and by rule `touch` with voxels of 10 cm. ✗ marks a test that fails. The"
        " verdict is *agrees* if all four tests pass, *differs* if none passes, and *cannot be"
        " decided* otherwise.\n"
    )
    whys = [
        "As above." if s.why in [o.why for o in statements[:i]] else s.why
        for i, s in enumerate(statements)
    ]
    rows = (
        [s.said, f"**{s.verdict.value}**", s.found, why]
        for s, why in zip(statements, whys, strict=True)
    )
    yield table(("published", "verdict", "measured here", "reason"), rows)
    yield "## The volume of one cone\n"
    yield (
        "The volume of one cone by counting voxels, in m³. Mean and standard deviation are over"
        f" {PLACES} random positions on the lattice.\n"
    )
    heads = ("rule", "voxel, m", "voxels", "volume", "mean", "standard deviation")
    yield table(heads, ([_short(cell) for cell in row.values()] for row in cone_volumes()))
    yield "## Configurations, and the tilt of n2_16_θ\n"
    yield "![Coverage of every setup over all targets, and of n2_16_θ](coverage.png)\n"
    yield from _configurations(f)
    yield from _along(f)
    yield from _monitored(f)
    yield "## What the paper does not state\n"
    yield table(("not stated", "chosen here"), CHOICES)
    yield from _open(f.open)


def _monitored(f: Findings) -> Iterator[str]:
    """Yield the section on the minimum distance."""
    yield "## Minimum distance\n"
    yield (
        "A human of articulated capsules walks and reaches on"
        f" {paper_distance.PATHS} random paths of {paper_distance.DURATION:g} s while the robot"
        " does its task. Every sensor measures the nearest point of the human in its beam. The"
        " system assumes that the point lies on the beam's axis at this distance, and that the"
        " human is at the sensors' range if no sensor measures anything. Errors count while the"
        " human is within that range. An engineering aid: none of these numbers is a safety"
        " rating.\n"
    )
    yield "![Error of the minimum distance of each setup](distance.png)\n"
    heads = (
        "setup",
        "RMSE, m",
        "largest error, m",
        "closing speed to base, RMSE, m/s",
        "closing speed to TCP, RMSE, m/s",
        "undetected, % of time",
        "nearest undetected, m",
    )
    keys = (
        "rmse_m",
        "max_error_m",
        "rmse_speed_base",
        "rmse_speed_tcp",
        "unseen_share",
        "unseen_nearest_m",
    )

    def line(setup: str) -> list[str]:
        found = summary(f.distances[setup, "shadow", "human"])
        return [
            f"{found[key][0] * s:.{d}f} ± {found[key][1] * s:.{d}f}"
            for key, s, d in zip(keys, _SCALES, _DIGITS, strict=True)
        ]

    setups = list(dict.fromkeys(setup for setup, _, _ in f.distances))
    yield "Human, with self-occlusion; means over paths with 95 % intervals:\n"
    yield table(heads, ([_name(setup), *line(setup)] for setup in setups))
    yield (
        "RMSE in m for each moving object, with self-occlusion. The rod, the ball and the parcel"
        " move along the robot at distances of 3 cm to 1.25 m. They also come near the base, which"
        " no ring covers; hence their large errors.\n"
    )
    yield table(
        ("setup", *THINGS),
        (
            [
                _name(setup),
                *(f"{summary(f.distances[setup, 'shadow', t])['rmse_m'][0]:.3f}" for t in THINGS),
            ]
            for setup in setups
        ),
    )
    yield (
        "Final distance between a ball and the moving arm on a path that no beam meets, at the pose"
        " of the highest TCP speed:\n"
    )
    names = ["setup", *(f"ball of {200 * r:g} cm, distance in cm" for r in paper_distance.BALLS)]
    yield table(
        names,
        (
            [_name(name), *(f"{100 * a['gap_m']:.0f}" for a in found)]
            for name, found in f.approaches.items()
        ),
    )


def _along(f: Findings) -> Iterator[str]:
    """Yield the section on coverage along the task."""

    def cell(setup: str, target: str) -> str:
        zeta = [r.zeta_percent for r in f.cycle if (r.setup, r.target) == (setup, target)]
        return f"{min(zeta):.1f} to {max(zeta):.1f}"

    names = [str(NEAR), str(FAR)]
    yield "## Along the task\n"
    yield (
        "Coverage does not change while only the base moves, because robot, beams and shell rotate"
        " together. It changes while other joints move: down to a product, up again, and over to"
        " the other row. Minimum and maximum of ζ along one cycle, in percent:\n"
    )
    yield table(
        ("setup", *names),
        ([_name(s), *(cell(s, t) for t in names)] for s in dict.fromkeys(r.setup for r in f.cycle)),
    )


def _short(number: object) -> str:
    return f"{number:.4f}".rstrip("0").rstrip(".") if isinstance(number, float) else f"{number}"


def _configurations(f: Findings) -> Iterator[str]:
    """Yield ζ of all setups as tables, one for each chain."""
    names = [str(t) for t in TARGETS]
    for chain in CHAINS:
        setups = [*SETUPS, *(f.searched if chain == "ur10" else ())]

        def cell(setup: str, target: str, chain: str = chain) -> str:
            found = [
                value(f.configurations, chain=chain, setup=setup, target=target, rule=rule)
                for rule, _ in COUNTS
            ]
            return f"{found[0]:.1f} ({found[1]:.1f})"

        yield (
            f"ζ in percent on `{chain}`: {COUNT_NAMES['centre']}, in brackets"
            f" {COUNT_NAMES['touch']}.\n"
        )
        yield table(("setup", *names), ([_name(s), *(cell(s, t) for t in names)] for s in setups))


def _name(setup: str) -> str:
    goal, _, sensors = setup.partition(" ")
    return f"searched for {goal}, {sensors} sensors" if sensors else setup


def _open(rows: Sequence[CoverageRow]) -> Iterator[str]:
    """Yield the range of ζ over all open choices."""
    names = [str(t) for t in OPEN_TARGETS]

    def cell(setup: str, target: str, rule: str) -> str:
        found = [
            r.zeta_percent for r in rows if (r.setup, r.target, r.rule) == (setup, target, rule)
        ]
        return f"{found[0]:.1f}: {np.min(found):.1f} to {np.max(found):.1f}"

    heads = [f"{t}, {rule}" for rule, _ in COUNTS for t in names]
    yield (
        "Each choice was varied on its own, on `ur10`. ζ in percent as chosen, then its minimum and"
        " maximum over all variants, which include voxels of half and twice the side:\n"
    )
    yield table(
        ("setup", *heads),
        ([s, *(cell(s, t, rule) for rule, _ in COUNTS for t in names)] for s in OPEN_SETUPS),
    )
