"""Arrows run downward: what a room may import, and what stays out of the core. All files are found
by rule.
"""

import ast
import runpy
import shutil
from functools import cache
from pathlib import Path

import pytest
from place_rings.studies.engine.import_closure import import_closure

from ..support.rooms import FRONT, ROOT, folders, installed_parts, modules, rooms, shaped_modules

MAY = {
    "coverage": set(),
    "objectives": {"coverage"},
    "placement": {"coverage", "objectives"},
    "simulation": {"coverage", "objectives"},
    "formats": {"coverage", "objectives", "placement"},
    "reporting": {"coverage", "objectives", "simulation", "formats"},
    "viewer": {"coverage", "objectives", "placement", "simulation", "formats", "reporting"},
    "studies": {"coverage", "objectives", "placement", "simulation", "formats", "reporting"},
    "rig": {"coverage", "objectives", "simulation", "formats", "reporting"},
    "api": {
        "coverage",
        "objectives",
        "placement",
        "simulation",
        "formats",
        "reporting",
        "viewer",
        "studies",
    },
    "cli": {
        "coverage",
        "objectives",
        "placement",
        "simulation",
        "formats",
        "reporting",
        "viewer",
        "studies",
        "rig",
        "api",
    },
}
TYPES = runpy.run_path(str(ROOT / ".ci/typecheck.py"))
CORE = {"coverage", "objectives"}
NOT_IN_CORE = {
    "matplotlib",
    "serial",
    "rtde_control",
    "rtde_receive",
    "viser",
    "rich",
    "cyclopts",
    "tomllib",
    "pydantic",
}


@cache
def nodes(path):
    return tuple(
        node
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Import | ast.ImportFrom)
    )


def ours(path, root):
    """Of every relative import in a file the parts of what it names, from the top; what is no room
    is the front's."""
    package = installed_parts(path.relative_to(root).parent)
    known = rooms(root)
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = package[: len(package) - node.level + 1]
            names = [node.module] if node.module else [alias.name for alias in node.names]
            for name in names:
                parts = (*above, *name.split("."))
                yield parts if parts[0] in known else (FRONT, *parts)


def others(path):
    """Top names of all other imports in a file."""
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


def wrong_arrows(room, root=ROOT):
    """What files of a room import and may not."""
    for path in (root / room).rglob("*.py"):
        for parts in ours(path, root):
            if parts[0] != room and parts[0] not in MAY[room]:
                yield f"{path.relative_to(root)} imports {'.'.join(parts)}"
        for top in others(path):
            if top == "place_rings":
                yield f"{path.relative_to(root)} imports a room by the name it is installed by"
            if room in CORE and top in NOT_IN_CORE:
                yield f"{path.relative_to(root)} imports {top}"


def circle(folder, root=ROOT):
    """Those of a folder's files, and of the rooms in it, each of these taken as one, that import
    each other in a circle.
    """
    here = folder.relative_to(root).parts
    needs = {}
    for path in folder.rglob("*.py"):
        name = path.relative_to(root).with_suffix("").parts[len(here)]
        inside = {
            parts[len(here)]
            for parts in ours(path, root)
            if len(parts) > len(here) and parts[: len(here)] == here
        }
        needs[name] = needs.get(name, set()) | inside - {name}
    while free := [name for name, needed in needs.items() if not needed & set(needs)]:
        for name in free:
            del needs[name]
    return sorted(needs)


def installed(root):
    """What setup.py hands to setuptools."""
    return TYPES["handed_to_setuptools"](root)


def installed_as(folder):
    """The package that a folder below the root is installed as."""
    return ".".join(("place_rings", *installed_parts(folder)))


def test_every_folder_with_code_is_a_room_and_is_installed():
    assert set(rooms()) == set(MAY)
    given = installed(ROOT)
    assert given["package_dir"] == {installed_as(Path(room)): room for room in MAY}
    assert sorted(given["packages"]) == sorted(
        installed_as(folder.relative_to(ROOT)) for folder in folders()
    )


@pytest.mark.parametrize("room", MAY)
def test_arrows_between_rooms_run_downward(room):
    assert list(wrong_arrows(room)) == []


def test_no_room_is_above_one_that_may_import_it():
    lower = set()
    for room, may in MAY.items():
        assert may <= lower, room
        lower.add(room)


@pytest.mark.parametrize(
    "folder", folders(), ids=lambda folder: folder.relative_to(ROOT).as_posix()
)
def test_arrows_in_a_room_make_no_circle(folder):
    assert circle(folder) == []


def test_a_public_class_has_a_name_of_its_own():
    places = {}
    for name, file in modules():
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(name)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


@pytest.fixture
def house(tmp_path):
    """A copy of the rooms, and of what has to know their files, with a file more and a sub-room
    more.
    """
    house = tmp_path / "house"
    for room in MAY:
        shutil.copytree(ROOT / room, house / room, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "setup.py", house)
    added = house / "coverage" / "added"
    added.mkdir()
    (added / "__init__.py").touch()
    (added / "inner.py").write_text("from jaxtyping import Float\n")
    (house / "coverage" / "outer.py").write_text("from .added.inner import Float\n")
    return house


def test_a_new_file_and_a_new_sub_room_need_no_edit_anywhere(house):
    assert "place_rings.coverage.added" in installed(house)["packages"]
    assert not list(wrong_arrows("coverage", house))
    assert not [folder for folder in folders(house) if circle(folder, house)]
    assert set(shaped_modules(house)) - set(shaped_modules()) == {
        "place_rings.coverage.added.inner"
    }
    assert house / "coverage/added/inner.py" in import_closure([house / "coverage/outer.py"], house)
    assert TYPES["installed_modules"](house) == dict(modules(house))


def test_the_type_check_reads_which_modules_were_checked():
    report = "      3       3      0      0 total\n      3       2      0      0 place_rings.a.b\n"
    assert TYPES["seen"](report) == {"place_rings.a.b"}


def test_a_circle_and_an_arrow_upward_are_seen(house):
    (house / "coverage/added/inner.py").write_text(
        "from ..outer import Float\nfrom ...cli import app\n"
    )
    assert circle(house / "coverage", house) == ["added", "outer"]
    assert list(wrong_arrows("coverage", house)) == ["coverage/added/inner.py imports cli"]
