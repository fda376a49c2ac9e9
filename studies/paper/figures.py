"""Figures of the paper's coverage measurements, with the searched setups."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from ...reporting.plots import COLOURS, GREY, INK, MARKERS, plain, save, sheet
from .coverage_cells import (
    BUDGETS,
    COUNTS,
    FAR,
    GOALS,
    NEAR,
    PUBLISHED,
    RADII,
    SETUPS,
    TARGETS,
    THETAS,
    CoverageRow,
)
from .open_choices import AS_CHOSEN
from .open_choices import SETUPS as OPEN_SETUPS

_EIGHTY = tuple(f"{goal} 80" for goal in GOALS)
COUNT_NAMES = {"centre": "unbiased (centre, 1 cm)", "touch": "touched voxels of 10 cm"}


def value(rows: Iterable[CoverageRow], **keys: object) -> float:
    """Return ζ of the one row that has all these values; KeyError if there is none."""
    for row in rows:
        if all(getattr(row, key) == wanted for key, wanted in keys.items()):
            return row.zeta_percent
    raise KeyError(f"no row with {keys}")


def configurations(rows: Sequence[CoverageRow], file: Path) -> None:
    """Draw bars of every setup for all targets, under both rules, on `ur10`."""
    searched = [f"{goal} {n}" for n in BUDGETS for goal in GOALS]
    names = [*SETUPS, *searched]
    figure = sheet(14, 8.5)
    axes = figure.subplots(len(COUNTS), 1, sharex=True)
    for ax, (rule, _) in zip(axes, COUNTS, strict=True):
        for k, target in enumerate(map(str, TARGETS)):
            height = [value(rows, chain="ur10", setup=n, target=target, rule=rule) for n in names]
            x = (
                np.arange(len(names))
                + 0.16 * (k - 2)
                + 0.25 * (np.arange(len(names)) >= len(SETUPS))
            )
            ax.bar(x, height, 0.15, color=COLOURS[k], label=target)
        for target, said in PUBLISHED.items():
            place = names.index("n3_16_55") + 0.16 * ([str(t) for t in TARGETS].index(target) - 2)
            label = "published" if target == str(NEAR) else ""
            ax.plot([place - 0.09, place + 0.09], [said, said], color=INK, lw=2, label=label)
        ax.axvline(len(SETUPS) - 0.375, color=GREY, lw=0.8, ls=(0, (4, 3)))
        ax.set_ylim(0, 105)
        plain(ax, COUNT_NAMES[rule], y="coverage ζ, percent")
        ax.grid(False, axis="x")
    at = [*range(len(SETUPS)), *(len(SETUPS) + 0.25 + k for k in range(len(searched)))]
    axes[-1].set_xticks(at, [*SETUPS, *(name.replace(" ", "\n") for name in searched)])
    axes[-1].set_xlabel(
        "the paper's layouts, and setups searched for near, far or both with 48, 80 or 112 sensors"
    )
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6, frameon=False)
    save(figure, file)


def _best(rows: Sequence[CoverageRow], rule: str, target: str) -> float:
    """Return the best ζ of a searched setup of 80 sensors, or NaN if none was counted."""
    found = [
        r.zeta_percent for r in rows if (r.rule, r.target) == (rule, target) and r.setup in _EIGHTY
    ]
    return max(found, default=float("nan"))


def _searched(ax: Axes, levels: dict[str, tuple[float, str]]) -> None:
    """Mark the best ζ of the searched setups of 80 sensors at the right edge."""
    for level, colour in levels.values():
        ax.plot(
            [1.0, 1.025],
            [level, level],
            color=colour,
            lw=2.5,
            transform=ax.get_yaxis_transform(),
            clip_on=False,
        )


def tilts(
    rows: Sequence[CoverageRow],
    configurations: Sequence[CoverageRow],
    targets: Sequence[str],
    file: Path,
) -> None:
    """Plot n2_16_theta against theta for both rules and chains.

    Marks on the right show the searched setup of 80 sensors.
    """
    figure = sheet(12, 8.4)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for line, chain in zip(axes, ("ur10", "ur10_dh"), strict=True):
        for ax, (rule, _) in zip(line, COUNTS, strict=True):
            for k, target in enumerate(targets):
                zeta = [
                    value(rows, chain=chain, rule=rule, target=target, at=theta) for theta in THETAS
                ]
                ax.plot(
                    THETAS, zeta, color=COLOURS[k], marker=MARKERS[k], ms=4, lw=1.6, label=target
                )
            if chain == "ur10":
                _searched(
                    ax,
                    {
                        t: (_best(configurations, rule, t), COLOURS[k])
                        for k, t in enumerate(targets)
                    },
                )
            plain(ax, f"{chain}, {COUNT_NAMES[rule]}")
            ax.set_ylim(25, 101)
            ax.set_xticks(THETAS)
    for ax in axes[-1]:
        ax.set_xlabel("tilt θ of n2_16_θ, degrees")
    for line in axes:
        line[0].set_ylabel("coverage ζ, percent")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(targets), frameon=False)
    figure.supxlabel(
        "bars at the right edge of the upper panels: the best searched setup of 80 sensors",
        fontsize=9,
        color=GREY,
    )
    save(figure, file)


def sweep(rows: Sequence[CoverageRow], configurations: Sequence[CoverageRow], file: Path) -> None:
    """Plot coverage of all targets against theta."""
    tilts(rows, configurations, [str(t) for t in TARGETS], file)


def shells(rows: Sequence[CoverageRow], configurations: Sequence[CoverageRow], file: Path) -> None:
    """Plot coverage of the shell against theta, for each radius."""
    tilts(rows, configurations, [f"V_S({r:g})" for r in RADII], file)


def cycle(
    rows: Sequence[CoverageRow],
    time: Float[np.ndarray, " T"],
    speed: Float[np.ndarray, " T"],
    file: Path,
) -> None:
    """Plot coverage and TCP speed along one cycle of the task.

    Args:
        rows: coverage along the cycle.
        time: time, s.
        speed: speed of the TCP, m/s.
        file: PNG to write.
    """
    figure = sheet(11, 8)
    axes = figure.subplots(3, 1, sharex=True, height_ratios=(1, 1, 0.6))
    for ax, target in zip(axes[:2], (str(NEAR), str(FAR)), strict=True):
        mine = [r for r in rows if r.target == target]
        for k, name in enumerate(dict.fromkeys(r.setup for r in mine)):
            at, zeta = zip(*((r.at, r.zeta_percent) for r in mine if r.setup == name), strict=True)
            label = f"searched, {name.split()[1]} sensors" if " " in name else name
            ax.plot(at, zeta, color=COLOURS[k], marker=MARKERS[k], ms=3.5, lw=1.5, label=label)
        plain(ax, target, y="ζ, percent")
    axes[2].fill_between(time, speed, color=GREY, alpha=0.35, lw=0)
    plain(axes[2], "speed of the TCP", "time in the task, s", "m/s")
    axes[2].set_ylim(0, None)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    save(figure, file)


def openness(rows: Sequence[CoverageRow], file: Path) -> None:
    """Plot how much each open choice changes ζ under `centre`, in points."""
    variants = [v for v in dict.fromkeys(r.variant for r in rows) if v != AS_CHOSEN]
    targets = list(dict.fromkeys(r.target for r in rows))
    figure = sheet(13, 7.6)
    axes = figure.subplots(1, len(targets), sharey=True)
    for ax, target in zip(axes, targets, strict=True):
        for k, name in enumerate(OPEN_SETUPS):
            mine = {
                r.variant: r.zeta_percent
                for r in rows
                if (r.target, r.setup, r.rule) == (target, name, "centre")
            }
            moved = [mine[v] - mine[AS_CHOSEN] for v in variants]
            y = np.arange(len(variants)) + 0.16 * (k - 1.5)
            ax.plot(moved, y, MARKERS[k], color=COLOURS[k], ms=5, label=name)
        ax.axvline(0, color=INK, lw=0.8)
        plain(ax, target, "change of ζ, points")
        ax.set_yticks(range(len(variants)), variants)
    axes[0].invert_yaxis()
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(OPEN_SETUPS), frameon=False
    )
    save(figure, file)
