"""Page of the reproduced paper: statements and verdicts, tables, figures, and open choices."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...reporting import distance_figures
from ...reporting.pages import csv_text, table
from ...simulation.distance import THINGS, summary
from ..engine.pages import page
from . import distance_cells as paper_distance
from . import figures
from .cone_volume import PLACES, cone_volumes
from .coverage_cells import (
    CHAINS,
    COUNTS,
    FAR,
    NEAR,
    OPEN_SETUPS,
    OPEN_TARGETS,
    SETUPS,
    TARGETS,
    CoverageRow,
)
from .coverage_statements import coverage
from .figures import COUNT_NAMES, value
from .statements import Statement
from .study import Findings

_MEASURES = (
    ("rmse_m", "RMSE, m", 1, 3),
    ("max_error_m", "largest error, m", 1, 2),
    ("rmse_speed_base", "closing speed to base, RMSE, m/s", 1, 2),
    ("rmse_speed_tcp", "closing speed to TCP, RMSE, m/s", 1, 2),
    ("unseen_share", "undetected, % of time", 100, 0),
    ("unseen_nearest_m", "nearest undetected, m", 1, 2),
)
"""Key, title, factor and digits of each measure of the minimum distance."""


def write(findings: Findings, folder: Path) -> dict[str, str]:
    """Draw the figures into ``folder`` and return the texts of the other files by name."""
    f = findings
    figures.coverage(f.configurations, f.tilts, folder / "coverage.png")
    distance_figures.errors(f.distances, folder / "distance.png")
    statements = [*coverage(f.configurations, f.tilts), paper_distance.statement(f.distances)]
    rows = [*f.configurations, *f.tilts, *f.cycle, *f.open]
    return {
        "data.csv": csv_text([vars(row) for row in rows]),
        "README.md": _page(f, statements),
    }


def _page(f: Findings, statements: Sequence[Statement]) -> str:
    whys = [
        "As above." if s.why in [o.why for o in statements[:i]] else s.why
        for i, s in enumerate(statements)
    ]
    judged = (
        [s.said, f"**{s.verdict.value}**", s.found, why]
        for s, why in zip(statements, whys, strict=True)
    )
    heads = ("rule", "voxel, m", "voxels", "volume", "mean", "standard deviation")
    volumes = ([_short(cell) for cell in row.values()] for row in cone_volumes())
    return page(
        "paper",
        statements=table(("published", "verdict", "measured here", "reason"), judged),
        places=PLACES,
        volumes=table(heads, volumes),
        configurations="\n".join(_configurations(f)),
        cycle=_along(f),
        paths=paper_distance.PATHS,
        duration=paper_distance.DURATION,
        **_monitored(f),
        open=_open(f.open).rstrip(),
    )


def _monitored(f: Findings) -> dict[str, str]:
    """Return the tables on the minimum distance."""

    def line(setup: str) -> list[str]:
        found = summary(f.distances[setup, "shadow", "human"])
        return [
            f"{found[key][0] * s:.{d}f} ± {found[key][1] * s:.{d}f}" for key, _, s, d in _MEASURES
        ]

    def errors(setup: str) -> list[str]:
        each = (summary(f.distances[setup, "shadow", t])["rmse_m"][0] for t in THINGS)
        return [f"{error:.3f}" for error in each]

    setups = list(dict.fromkeys(setup for setup, _, _ in f.distances))
    balls = [f"ball of {200 * r:g} cm, distance in cm" for r in paper_distance.BALLS]
    gaps = (
        [_name(name), *(f"{100 * a['gap_m']:.0f}" for a in found)]
        for name, found in f.approaches.items()
    )
    heads = ("setup", *(title for _, title, *_ in _MEASURES))
    return {
        "human": table(heads, ([_name(setup), *line(setup)] for setup in setups)),
        "things": table(("setup", *THINGS), ([_name(s), *errors(s)] for s in setups)),
        "approaches": table(("setup", *balls), gaps),
    }


def _along(f: Findings) -> str:
    """Return the table of coverage along the task."""

    def cell(setup: str, target: str) -> str:
        zeta = [r.zeta_percent for r in f.cycle if (r.setup, r.target) == (setup, target)]
        return f"{min(zeta):.1f} to {max(zeta):.1f}"

    names, setups = [str(NEAR), str(FAR)], dict.fromkeys(r.setup for r in f.cycle)
    return table(("setup", *names), ([_name(s), *(cell(s, t) for t in names)] for s in setups))


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


def _open(rows: Sequence[CoverageRow]) -> str:
    """Return the table of the range of ζ over all open choices."""
    columns = [(str(t), rule) for rule, _ in COUNTS for t in OPEN_TARGETS]

    def cell(*where: str) -> str:
        zeta = [r.zeta_percent for r in rows if (r.setup, r.target, r.rule) == where]
        return f"{zeta[0]:.1f}: {np.min(zeta):.1f} to {np.max(zeta):.1f}"

    heads = ("setup", *(f"{t}, {rule}" for t, rule in columns))
    return table(heads, ([s, *(cell(s, *column) for column in columns)] for s in OPEN_SETUPS))
