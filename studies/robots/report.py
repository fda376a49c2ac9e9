"""What the study of robots shows: tables, a picture, and each searched setup as a proposal."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from ...coverage.occlusion.model import OCCLUSIONS
from ...formats.schema.proposal_models import ProposalFile
from ...formats.schema.ring_models import RingModel
from ...formats.schema.scene_models import SceneModel
from ...formats.writing import to_toml
from ...reporting.pages import csv_text, html, table
from ..engine.scenes import scene_from
from .figure import picture
from .study import PROCESSORS, SEARCHES, SECONDS, SENSORS, TARGET, VOXEL, RobotRow, pose_deg, where

_SAID = {
    "ignore": "searched under `ignore`",
    "ignore_mounted": "searched under `ignore`, on a real mount",
    "shadow": "searched under `shadow`",
    "blind": "searched under `blind`",
}


def write(rows: Sequence[RobotRow], folder: Path, command: str) -> dict[str, str]:
    """Draw the picture into ``folder`` and return the texts of the other files by name."""
    picture(rows, folder / "robots.png")
    text = "\n".join(_page(rows, command))
    searched = [row for row in rows if row.searched]
    files = {"robots.csv": csv_text([_record(row) for row in rows]), "README.md": text}
    files |= {"report.html": html(text, folder, "What ignoring the robot's body costs")}
    return files | {_file(row): _proposal(row) for row in searched}


def _file(row: RobotRow) -> str:
    return f"{row.robot}_{row.name}.toml"


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


def _proposal(row: RobotRow) -> str:
    seen = ", ".join(f"{model} {getattr(row, model):.2f} %" for model in OCCLUSIONS)
    heading = (
        f"{TARGET} of {row.robot}, {_SAID[row.name].replace('`', '')}: {seen} (rule centre, voxels"
        " of 1 cm)."
    )
    rings = [RingModel.model_validate(ring) for ring in row.rings]
    scene = SceneModel.from_domain(scene_from(where(row.robot, SEARCHES[row.name])))
    return to_toml(ProposalFile(rings=rings, scene=scene), heading)


def _page(rows: Sequence[RobotRow], command: str) -> Iterator[str]:
    yield "# What ignoring the robot's body costs\n"
    yield (
        f"`{command}`: the best ζ of {TARGET} that {SENSORS} sensors in any rings reach on six"
        " robots, each in its"
    )
    yield (
        f"own pose, searched under each model of occlusion in what {PROCESSORS} processors do in"
        f" {SECONDS:g} s, and seen"
    )
    yield (
        f"under all three. Counted exactly (rule `centre`, voxels of {100 * VOXEL:g} cm). The"
        " numbers are in `robots.csv`,"
    )
    yield "each searched setup is a proposal beside it.\n"
    yield (
        "![Each robot with the rings found under shadow, and what each setup sees under the three"
        " models](robots.png)\n"
    )
    yield "## The price\n"
    yield (
        "A search under `ignore` puts rings where it likes, as the paper does, also into housings;"
        " one on a real mount"
    )
    yield (
        "has rings with bodies, and so have those under `shadow` and `blind`. *Promised* is what"
        " the search under `ignore`"
    )
    yield (
        "says; *kept* what the same setup sees past the robot's body; *mounted* what the search"
        " under `ignore` keeps whose"
    )
    yield (
        "rings can be mounted; *found* what a search under that model reaches; *price* is found"
        " less mounted.\n"
    )
    yield table(*_prices(rows))
    yield _verdict(rows) + "\n"
    yield "## All setups\n"
    yield (
        "ζ in percent; *unseeing*: sensors that see less than a hundredth of their cones past the"
        " body; *s*: of the"
    )
    yield (
        "search, seconds of processors, all together, with a * where the limit of"
        f" {PROCESSORS * SECONDS:g} s, of which a"
    )
    yield (
        "fifth is kept for the exact count, cut its climbs short; in brackets those on the wall, of"
        " a machine that other"
    )
    yield "jobs used too.\n"
    for robot in dict.fromkeys(row.robot for row in rows):
        scene = scene_from(where(robot, {}))
        angles = ", ".join(f"{a:g}" for a in pose_deg(robot))
        yield f"### {robot}\n"
        yield f"Pose {angles}°, reach {scene.robot.reach:g} m.\n"
        yield table(
            ("setup", "sensors", "rings", *OCCLUSIONS, "unseeing", "s"),
            map(_line, (r for r in rows if r.robot == robot)),
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
    """Robot by robot what a search under ``ignore`` promises, what of it is kept, and what one that
    knew better finds.
    """
    models = [model for model in OCCLUSIONS if model != "ignore"]
    heads = ["robot", "promised"] + [
        f"{model}: {what}" for model in models for what in ("kept", "mounted", "found", "price")
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
    """What the tables say together."""

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
        f"A setup searched under `ignore` loses {span(lost['shadow'])} points once the body shadows"
        f" and {span(lost['blind'])} once it blinds;\nthe paper's setups lose"
        f" {span(by_hand['shadow'])} and {span(by_hand['blind'])}. Of setups that can be mounted, a"
        f" search that knew of the body\nsees {span(price['shadow'])} points more under `shadow`"
        f" and {span(price['blind'])} under `blind`."
    )
