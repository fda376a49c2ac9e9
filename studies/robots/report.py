"""Page of the study of robots: tables, a figure, and the setup found under ``shadow`` on each."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ...coverage.occlusion.occlusion_mode import OCCLUSIONS
from ...reporting.pages import csv_text, table
from ..engine.pages import FILE, HOW, page, setups_toml
from ..engine.scenes import scene_from
from .figure import SHOWN, robots_figure
from .study import PROCESSORS, SEARCHES, SECONDS, SENSORS, TARGET, VOXEL, RobotRow, pose_deg, where

_SAID = {
    "ignore": "searched under `ignore`",
    "ignore_mounted": "searched under `ignore`, on a real mount",
    "shadow": "searched under `shadow`",
    "blind": "searched under `blind`",
}


def write(rows: Sequence[RobotRow], folder: Path) -> dict[str, str]:
    """Draw the figure into ``folder`` and return the texts of the other files by name."""
    robots_figure(rows, folder / "robots.png")
    taken = {
        row.robot: (row.rings, where(row.robot, SEARCHES[SHOWN]))
        for row in rows
        if row.name == SHOWN
    }
    return {
        "data.csv": csv_text([_record(row) for row in rows]),
        "README.md": _page(rows),
        FILE: setups_toml(taken),
    }


def _record(row: RobotRow) -> dict[str, object]:
    head = {"robot": row.robot, "setup": row.name, "sensors": row.sensors, "rings": len(row.rings)}
    percents = {f"{model}_percent": getattr(row, model) for model in OCCLUSIONS}
    spent = (row.processor_seconds, row.wall_seconds, row.finished)
    cells = [
        "" if value is None else value if isinstance(value, bool) else round(value, 1)
        for value in spent
    ]
    names = ("processor_seconds", "wall_seconds", "finished")
    return head | percents | {"unseeing": row.unseeing} | dict(zip(names, cells, strict=True))


def _page(rows: Sequence[RobotRow]) -> str:
    heads = ("setup", "sensors", "rings", *OCCLUSIONS, "blocked", "time, s")
    setups = []
    for robot in dict.fromkeys(row.robot for row in rows):
        angles = ", ".join(f"{a:g}" for a in pose_deg(robot))
        setups += [
            f"### {robot}\n",
            f"Pose {angles}°, reach {scene_from(where(robot, {})).robot.reach:g} m.\n",
            table(heads, map(_line, (r for r in rows if r.robot == robot))),
        ]
    each, hands = list(_by_robot(rows).values()), [row for row in rows if not row.searched]
    searched = [of["ignore"] for of in each]

    def spans(lost: Callable[[str], list[float]]) -> dict[str, str]:
        losses = {model: lost(model) for model in OCCLUSIONS}
        return {m: f"{min(values):.1f} to {max(values):.1f}" for m, values in losses.items()}

    def gained(model: str) -> list[float]:
        return [getattr(of[model], model) - getattr(of["ignore_mounted"], model) for of in each]

    return page(
        "robots",
        sensors=SENSORS,
        target=TARGET,
        processors=PROCESSORS,
        seconds=SECONDS,
        limit=PROCESSORS * SECONDS,
        voxel_cm=100 * VOXEL,
        prices=table(*_prices(rows)),
        lost=spans(lambda model: [row.ignore - getattr(row, model) for row in searched]),
        by_hand=spans(lambda model: [row.ignore - getattr(row, model) for row in hands]),
        price=spans(gained),
        setups="\n".join(setups),
        file=FILE,
        shown=SHOWN,
        how=HOW.rstrip(),
    )


def _line(row: RobotRow) -> list[str]:
    cut = "" if row.finished else " *"
    seconds = f"{row.processor_seconds:.0f}{cut} ({row.wall_seconds:.0f})" if row.searched else ""
    percents = [f"{getattr(row, model):.2f}" for model in OCCLUSIONS]
    return [
        _SAID.get(row.name, row.name),
        f"{row.sensors}",
        f"{len(row.rings)}",
        *percents,
        f"{row.unseeing}",
        seconds,
    ]


def _prices(rows: Sequence[RobotRow]) -> tuple[list[str], list[list[str]]]:
    """Return for each robot ζ of a search under ``ignore`` and of searches that account for the
    body.

    Returns:
        Headings and rows of a table.
    """
    models = [model for model in OCCLUSIONS if model != "ignore"]
    heads = ["robot", "ignore"] + [
        f"{model}: {what}"
        for model in models
        for what in ("same setup", "mountable", "searched", "gain")
    ]
    lines = []
    for robot, of in _by_robot(rows).items():
        cells = [robot, f"{of['ignore'].ignore:.2f}"]
        for model in models:
            kept, mounted, found = (
                getattr(of[name], model) for name in ("ignore", "ignore_mounted", model)
            )
            cells += [f"{kept:.2f}", f"{mounted:.2f}", f"{found:.2f}", f"{found - mounted:+.2f}"]
        lines.append(cells)
    return heads, lines


def _by_robot(rows: Sequence[RobotRow]) -> dict[str, dict[str, RobotRow]]:
    return {
        robot: {row.name: row for row in rows if row.robot == robot}
        for robot in dict.fromkeys(r.robot for r in rows)
    }
