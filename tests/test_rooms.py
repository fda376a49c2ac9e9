"""Arrows run downward: what a room may import, and what stays out of the core."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY = {
    "coverage": set(),
    "objectives": {"coverage"},
    "placement": {"coverage", "objectives"},
    "placement/export": {
        "",
        "errors",
        "meshes",
        "mounted",
        "mounted_poses",
        "printing",
        "robot_convert",
        "sensor_frames",
        "urdf",
        "urdf_robot",
    },
    "placement/printing": {"errors", "loader", "results"},  # of placement
    "studies": {"coverage", "objectives", "placement"},
    "rig": {"coverage", "objectives", "placement"},
    "rig/simulated": {"protocol", "records"},  # of rig
    "cli/reporting": {  # of cli
        *("aim_options", "motion", "picture", "place", "protective", "robustness", "sensing", "sighting", "tables")
    },
    "cli": {"coverage", "objectives", "placement", "studies", "rig"},
    "cli/viewer": {"tables"},  # of cli
}
CORE = {"coverage", "objectives"}
NOT_IN_CORE = {"matplotlib", "serial", "rtde_control", "rtde_receive", "viser", "rich", "cyclopts", "tomllib", "pydantic"}


def imports(path):
    """(top name, room of ours or None) of every import in a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name.split(".")[0], None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield (node.module or "").split(".")[0], None
        elif isinstance(node, ast.ImportFrom) and node.level == 2:
            yield "", (node.module or "").split(".")[0]


@pytest.mark.parametrize("room", MAY)
def test_arrows_between_rooms_run_downward(room):
    for path in (ROOT / room).glob("*.py"):
        for top, ours in imports(path):
            assert ours is None or ours in MAY[room], f"{path.name} imports {ours}"
            assert room not in CORE or top not in NOT_IN_CORE, f"{path.name} imports {top}"


@pytest.mark.parametrize("room", MAY)
def test_arrows_between_files_make_no_circle(room):
    needs = {}
    for path in (ROOT / room).glob("*.py"):
        nodes = (n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom) and n.level == 1)
        needs[path.stem] = {(n.module or "").split(".")[0] for n in nodes}
    while needs:
        free = [name for name, others in needs.items() if not others & set(needs)]
        assert free, f"a circle among {sorted(needs)}"
        for name in free:
            del needs[name]
