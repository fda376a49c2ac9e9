"""Plot and page of the convergence study."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ...reporting.pages import csv_text, table
from ...reporting.plots import GREY, GRID, INK, save, sheet
from ..engine.pages import page
from ..paper.coverage_cells import FAR, NEAR
from ..paper.coverage_cells import PUBLISHED as _BOTH
from .study import TARGETS, ConvergenceRow, errors, order

SHOWN = "n3_16_55"
PUBLISHED = _BOTH | {"V_OT": 65.0}  # published as "over 65"
COLOURS = {"centre": "#0072B2", "touch": "#D55E00", "certified": "#009E73"}


def write(rows: list[ConvergenceRow], folder: Path) -> dict[str, str]:
    """Draw the plot into ``folder`` and return the texts of the other files by name."""
    convergence_plot(rows, folder / "convergence.png")
    truth = {r.key[:3]: r for r in rows if r.rule == "truth"}
    touch = {r.key[:3]: r.zeta_percent for r in rows if r.rule == "touch" and r.voxel == 0.1}
    names, robots = [str(t) for t in TARGETS], sorted({r.robot for r in rows})
    orders = ([rule, *(f"{order(rows, rule, t):.2f}" for t in names)] for rule in COLOURS)
    where = [(robot, t) for robot in robots for t in names]
    counts = (
        [
            setup,
            *(
                f"{truth[robot, setup, t].zeta_percent:.2f} ({touch[robot, setup, t]:.2f})"
                for robot, t in where
            ),
        ]
        for setup in dict.fromkeys(r.setup for r in rows)
    )
    published = (
        [
            robot,
            target,
            f"{PUBLISHED[target]:.2f}" if target != "V_OT" else "over 65",
            f"{truth[robot, setup, target].zeta_percent:.2f}",
            f"{touch[robot, setup, target]:.2f}",
        ]
        for robot, setup, target in truth
        if setup == SHOWN
    )
    text = page(
        "convergence",
        orders=table(("rule", *names), orders),
        counts=table(("setup", *(f"{t}, {robot}" for robot, t in where)), counts),
        near=PUBLISHED[str(NEAR)],
        far=PUBLISHED[str(FAR)],
        published=table(
            ("chain", "target", "published, %", "reference, %", "`touch`, 10 cm, %"), published
        ).rstrip(),
    )
    return {"README.md": text, "data.csv": csv_text([vars(row) for row in rows])}


def _zeta(ax: Axes, rows: list[ConvergenceRow], robot: str, target: str) -> None:
    """Plot ζ of one setup against the voxel, rule by rule."""
    mine = [r for r in rows if (r.robot, r.setup, r.target) == (robot, SHOWN, target)]
    truth = next(r.zeta_percent for r in mine if r.rule == "truth")
    for rule, colour in COLOURS.items():
        line = sorted(
            (r.voxel, r.zeta_percent, r.low_percent, r.high_percent) for r in mine if r.rule == rule
        )
        voxel, zeta, low, high = 100 * np.array(line).T
        if rule == "certified":
            ax.fill_between(
                voxel, low / 100, high / 100, color=colour, alpha=0.18, lw=0, label="certified"
            )
        else:
            ax.plot(voxel, zeta / 100, "o-", color=colour, ms=4, lw=1.6, label=rule)
    ax.axhline(truth, color=INK, lw=1, label="reference, to 0.05 points")
    ax.axhline(PUBLISHED[target], color=GREY, lw=1, ls=(0, (5, 3)), label="published")
    ax.set_xscale("log")
    ax.set_title(f"{SHOWN}, {target}, {robot}", fontsize=10, loc="left", color=INK)
    ax.set_ylim(max(truth - 22, 0), min(max(truth, PUBLISHED[target]) + 12, 101))


def _errors(ax: Axes, rows: list[ConvergenceRow], target: str) -> None:
    """Plot the error of all setups on both chains against the voxel."""
    for rule, colour in COLOURS.items():
        for key, (voxels, off) in errors(rows, rule).items():
            if key[2] == target:
                ax.plot(
                    100 * np.array(voxels),
                    np.maximum(off, 1e-3),
                    color=colour,
                    lw=0.8,
                    alpha=0.55,
                )
    ax.set_xscale("log")
    ax.set_yscale("log")
    orders = ", ".join(f"{rule} {order(rows, rule, target):.1f}" for rule in COLOURS)
    title = f"all setups, both chains, {target}\norder: {orders}"
    ax.set_title(title, fontsize=10, loc="left", color=INK)


def convergence_plot(rows: list[ConvergenceRow], file: Path) -> None:
    """Draw the study: a row of axes for each chain, and one for the errors."""
    robots = sorted({r.robot for r in rows})
    figure = sheet(13, 11)
    axes = figure.subplots(len(robots) + 1, len(TARGETS))
    for column, target in enumerate(map(str, TARGETS)):
        for line, robot in enumerate(robots):
            _zeta(axes[line][column], rows, robot, target)
        _errors(axes[-1][column], rows, target)
        axes[-1][column].set_xlabel("voxel, cm")
    for line in axes:
        for ax in line:
            ax.grid(True, which="major", color=GRID, lw=0.6)
            ax.spines[["top", "right"]].set_visible(False)
            ax.set_xticks([1.25, 2.5, 5, 10, 20], ["1.25", "2.5", "5", "10", "20"])
            ax.minorticks_off()
    axes[0][0].set_ylabel("ζ, percent")
    axes[1][0].set_ylabel("ζ, percent")
    axes[-1][0].set_ylabel("error (certified: width), points")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False, fontsize=10)
    save(figure, file)
