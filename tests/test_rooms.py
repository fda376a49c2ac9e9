"""Arrows run downward: what a room may import, and what stays out of the core."""

import ast
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY = {
    "coverage": set(),
    "objectives": {"coverage"},
    "placement": {"coverage", "objectives"},
    "placement/files": {
        "errors"
    },  # of placement, as in all that follow: a room in a room may import files and rooms beside it
    "placement/robot": {"errors"},
    "placement/mounted": {"errors", "files", "robot"},
    "placement/improving": {"candidates", "climb", "files", "places", "progress", "schedule"},
    "placement/export": {"errors", "files", "mounted", "printing", "robot"},
    "placement/printing": {"errors", "escaping", "files", "loader"},
    "studies": {"coverage", "objectives", "placement"},
    "rig": {"coverage", "objectives", "placement"},
    "rig/recording": set(),
    "rig/rings": {"recording"},
    "rig/robot": {"recording"},
    "rig/listening": {"recording", "rings", "robot"},
    "rig/sensing": set(),
    "rig/poses": {"sensing"},
    "rig/mount": {"poses", "sensing"},
    "rig/rod": {"poses", "sensing"},
    "rig/simulated": {"rings"},
    "rig/simulated_cell": {"mount", "rod", "sensing", "simulated"},
    "cli": {"coverage", "objectives", "placement", "studies", "rig"},
    "cli/reporting": {
        "aim_options",
        "motion",
        "picture",
        "place",
        "protective",
        "robustness",
        "sensing",
        "sighting",
        "tables",
        "terminal",
        "words",
    },
    "cli/viewer": {"tables", "words"},
}
CORE = {"coverage", "objectives"}
NOT_IN_CORE = {"matplotlib", "serial", "rtde_control", "rtde_receive", "viser", "rich", "cyclopts", "tomllib", "pydantic"}


@cache
def nodes(path):
    return tuple(node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Import | ast.ImportFrom))


def ours(path):
    """Of every relative import in a file the parts of what it names, from the top."""
    package = path.relative_to(ROOT).parts[:-1]
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = package[: len(package) - node.level + 1]
            names = [node.module] if node.module else [alias.name for alias in node.names]
            yield from ((*above, *name.split(".")) for name in names)


def others(path):
    """Top names of all other imports in a file."""
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


def test_every_folder_with_code_is_a_room_and_is_installed():
    tops = {room.split("/")[0] for room in MAY}
    assert {path.parent.relative_to(ROOT).as_posix() for top in tops for path in (ROOT / top).rglob("*.py")} == set(MAY)
    installed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    assert installed["package-dir"] == {f"place_rings.{room.replace('/', '.')}": room for room in MAY}
    assert sorted(installed["packages"]) == sorted(installed["package-dir"])


@pytest.mark.parametrize("room", MAY)
def test_arrows_between_rooms_run_downward(room):
    here = tuple(room.split("/"))
    for path in (ROOT / room).glob("*.py"):
        for parts in ours(path):
            if parts[: len(here)] == here:
                continue
            allowed = MAY[room] if parts[0] == here[0] else MAY[here[0]]
            found = parts[1] if parts[0] == here[0] else parts[0]
            assert found in allowed, f"{path.name} imports {'.'.join(parts)}"
        for top in others(path):
            assert top != "place_rings", f"{path.name} imports its own room by the name it is installed by"
            assert room not in CORE or top not in NOT_IN_CORE, f"{path.name} imports {top}"


@pytest.mark.parametrize("room", MAY)
def test_arrows_in_a_room_make_no_circle(room):
    """Among its files, and among its files and the rooms in it, each of these taken as one."""
    depth = room.count("/") + 1
    needs = {}
    for path in (ROOT / room).rglob("*.py"):
        name = path.relative_to(ROOT).with_suffix("").parts[depth]
        inside = {parts[depth] for parts in ours(path) if parts[:depth] == tuple(room.split("/"))}
        needs[name] = needs.get(name, set()) | inside - {name}
    while needs:
        free = [name for name, needed in needs.items() if not needed & set(needs)]
        assert free, f"a circle among {sorted(needs)}"
        for name in free:
            del needs[name]
