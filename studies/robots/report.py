"""Page of the study of robots: tables, a figure, and the setup found under ``shadow`` on each."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from ...coverage.occlusion.occlusion_mode import OCCLUSIONS
from ...reporting.pages import csv_text, table
from ..engine.scenes import scene_from
from ..engine.setups_file import FILE, HOW, setups_toml
from .figure import SHOWN, picture
from .study import PROCESSORS, SEARCHES, SECONDS, SENSORS, TARGET, VOXEL, RobotRow, pose_deg, where

_SAID = {
    "ignore": "searched under `ignore`",
    "ignore_mounted": "searched under `ignore`, on a real mount",
    "shadow": "searched under `shadow`",
    "blind": "searched under `blind`",
}


def write(rows: Sequence[RobotRow], folder: Path) -> dict[str, str]:
    """Draw the figure into ``folder`` and return the texts of the other files by name."""
    picture(rows, folder / "robots.png")
    taken = {
        row.robot: (row.rings, where(row.robot, SEARCHES[SHOWN]))
        for row in rows
        if row.name == SHOWN
    }
    return {
        "data.csv": csv_text([_record(row) for row in rows]),
        "README.md": "\n".join(_page(rows)),
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


def _page(rows: Sequence[RobotRow]) -> Iterator[str]:
    yield "# What ignoring the robot's body costs\n"
    yield (
        f"The study searches for the placement of {SENSORS} sensors in any rings with the best ζ of"
        f" {TARGET}, on six robots, each in its default pose, under each model of occlusion. A"
        f" search may use the processor time that {PROCESSORS} processors have in {SECONDS:g} s."
        " The tables give ζ under all three models, counted exactly (rule `centre`, voxels of"
        f" {100 * VOXEL:g} cm). The numbers are in `data.csv`.\n"
    )
    yield (
        "![Six arms with the rings found under shadow, and the coverage of each layout under the"
        " three models](robots.png)\n"
    )
    yield "## Cost of ignoring the body\n"
    yield (
        "A search under `ignore` places rings anywhere, as the paper does, even inside housings."
        " With real mounts, and always under `shadow` and `blind`, rings have bodies. The columns"
        " give ζ in percent:\n"
    )
    yield (
        "- *ignore*: the result of the search under `ignore`, counted under `ignore`;\n"
        "- *same setup*: this setup counted under the other model;\n"
        "- *mountable*: the result of a search under `ignore` with real mounts, counted under the"
        " other model;\n"
        "- *searched*: the result of a search under that model;\n"
        "- *gain*: searched minus mountable, in points.\n"
    )
    yield table(*_prices(rows))
    yield _verdict(rows) + "\n"
    yield "## All setups\n"
    yield (
        "ζ is in percent. *Blocked* counts sensors of which less than 1 % of the cone is"
        " unobstructed by the body. *Time* is the processor time of the search in seconds; a *"
        f" marks searches cut short by the limit of {PROCESSORS * SECONDS:g} s,"
        " of which a fifth is reserved for the exact count. The number in brackets is wall time.\n"
    )
    for robot in dict.fromkeys(row.robot for row in rows):
        scene = scene_from(where(robot, {}))
        angles = ", ".join(f"{a:g}" for a in pose_deg(robot))
        yield f"### {robot}\n"
        yield f"Pose {angles}°, reach {scene.robot.reach:g} m.\n"
        yield table(
            ("setup", "sensors", "rings", *OCCLUSIONS, "blocked", "time, s"),
            map(_line, (r for r in rows if r.robot == robot)),
        )
    yield "## Setups\n"
    yield f"`{FILE}` has the setup of each robot that was searched under `{SHOWN}`, by its name.\n"
    yield HOW


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


def _verdict(rows: Sequence[RobotRow]) -> str:
    """Summarise the tables."""

    def span(values: Sequence[float]) -> str:
        return f"{min(values):.1f} to {max(values):.1f}"

    each = list(_by_robot(rows).values())
    lost = {
        model: [of["ignore"].ignore - getattr(of["ignore"], model) for of in each]
        for model in ("shadow", "blind")
    }
    hands = [row for row in rows if not row.searched]
    by_hand = {
        model: [row.ignore - getattr(row, model) for row in hands] for model in ("shadow", "blind")
    }
    price = {
        model: [getattr(of[model], model) - getattr(of["ignore_mounted"], model) for of in each]
        for model in lost
    }
    return (
        f"A setup searched under `ignore` loses {span(lost['shadow'])} points under `shadow` and"
        f" {span(lost['blind'])} under `blind`; the paper's layouts lose {span(by_hand['shadow'])}"
        f" and {span(by_hand['blind'])}. Among mountable setups, a search that accounts for the"
        f" body covers {span(price['shadow'])} points more under `shadow` and"
        f" {span(price['blind'])} under `blind`."
    )
