"""Arrows run downward: what a room may import, and what stays out of the core. All files are found
by rule.
"""

import re
import runpy
import shutil
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from ..support.rooms import (
    FRONT,
    ROOT,
    folders,
    imports,
    installed_parts,
    modules,
    rooms,
    shaped_modules,
)

BASE = {"coverage", "objectives"}
SHARED = {*BASE, "placement", "simulation", "formats", "reporting"}
MAY = {
    "coverage": set(),
    "objectives": {"coverage"},
    "placement": BASE,
    "formats": BASE,
    "simulation": {*BASE, "formats"},
    "reporting": SHARED - {"placement", "reporting"},
    "viewer": SHARED,
    "studies": SHARED,
    "rig": SHARED - {"placement"},
    "api": SHARED | {"viewer", "studies"},
    "cli": SHARED | {"viewer", "studies", "rig", "api"},
}
# files of placement with only what its results state, which formats write and reporting prints
RECORDS = {("search", "result"), ("bound", "coverage_bound"), ("redesign", "changes")}
OF_RECORDS = {"formats", "reporting"}
TYPES = runpy.run_path(str(ROOT / ".ci/typecheck.py"))
NOT_IN_CORE = {"matplotlib", "serial", "rtde_control", "rtde_receive", "viser", "rich"}
NOT_IN_CORE |= {"cyclopts", "tomllib"}


def ours(path, root):
    """Of every import of ours in a file the parts of what it names, from the top; what is no room
    is the front's. Rooms name the front by the name it is installed by, as it stands beside them.
    """
    package = installed_parts(path.relative_to(root).parent)
    known = rooms(root)
    for level, module, names in imports(path):
        if module.startswith("place_rings._"):
            yield FRONT, *module.split(".")[1:]
        if level:
            above = package[: len(package) - level + 1]
            for name in [module] if module else names:
                parts = (*above, *name.split("."))
                yield parts if parts[0] in known else (FRONT, *parts)


def others(path):
    """Top names of all other imports in a file."""
    absolute = (module for level, module, _ in imports(path) if not level)
    return {m.split(".")[0] for m in absolute if not m.startswith("place_rings._")}


def wrong_arrows(room, root=ROOT):
    """What files of a room import and may not."""
    for path in (root / room).rglob("*.py"):
        for parts in ours(path, root):
            record = room in OF_RECORDS and parts[0] == "placement" and parts[1:3] in RECORDS
            if parts[0] != room and parts[0] not in MAY[room] and not record:
                yield f"{path.relative_to(root)} imports {'.'.join(parts)}"
        for top in others(path):
            if top == "place_rings":
                yield f"{path.relative_to(root)} imports a room by the name it is installed by"
            if room in BASE and top in NOT_IN_CORE:
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


def test_arrows_between_rooms_run_downward_and_make_no_circle_in_a_room():
    assert [wrong for room in MAY for wrong in wrong_arrows(room)] == []
    assert {folder: found for folder in folders() if (found := circle(folder))} == {}
    lower = set()
    for room, may in MAY.items():  # no room is above one that may import it
        assert may <= lower, room
        lower.add(room)


def test_a_public_class_has_a_name_of_its_own():
    places = {}
    for name, file in modules():
        for public in re.findall(r"^class ([A-Za-z]\w*)", file.read_text("utf-8"), re.M):
            places.setdefault(public, []).append(name)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CORE, EXTRAS = EXTRAS["dependencies"], EXTRAS["optional-dependencies"]


def distributions(requirements):
    """The normalised names of requirements, with those of our own extras."""
    found = set()
    for requirement in requirements:
        name = re.match(r"[\w.-]+", requirement)[0]
        if name == "place-rings":
            for extra in re.search(r"\[(.*)\]", requirement)[1].split(","):
                found |= distributions(EXTRAS[extra])
        else:
            found.add(re.sub(r"[-_.]+", "-", name).lower())
    return found


def test_all_that_is_imported_is_declared_and_what_is_rare_is_an_extra():
    core = distributions(CORE)
    *extras, everything, test = (
        distributions(EXTRAS[name])
        for name in ("bags", "cluster", "mujoco", "rig", "usd", "all", "test")
    )
    homes = packages_distributions()  # on Python 3.13 there is no ur-rtde
    homes |= {f"rtde_{part}": ["ur-rtde"] for part in ("control", "receive")}
    homes |= {"mujoco": ["mujoco"]}  # its parts install into one folder
    # the one until Python 3.13, the other in the standard library from 3.14 on
    homes |= {name: ["backports.zstd"] for name in ("backports", "compression")}
    by_room = {}
    for _, path in modules():
        tops = others(path) - sys.stdlib_module_names - {"place_rings", "pydantic_core"}
        used = by_room.setdefault(path.relative_to(ROOT).parts[0], set())
        used |= distributions(dist for top in tops for dist in homes.get(top, [top]))
    used = set().union(*by_room.values())
    rare = set().union(*extras)
    assert used <= core | rare
    rooms = {"rig", "formats"}, {"studies"}, {"simulation", "formats"}, {"rig"}, {"formats"}
    for extra, where in zip(extras, rooms, strict=True):
        assert {room for room, dists in by_room.items() if dists & extra} == where
    assert core <= used
    assert everything == rare | distributions(EXTRAS["robots"])
    assert test >= rare


@pytest.fixture
def house(tmp_path):
    """The rooms, all but one of them empty, with a file more and a sub-room more."""
    house = tmp_path / "house"
    shutil.copytree(
        ROOT / "coverage", house / "coverage", ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copy(ROOT / "setup.py", house)
    for folder in (*(house / room for room in set(MAY) - {"coverage"}), house / "coverage/added"):
        folder.mkdir()
        (folder / "__init__.py").touch()
    (house / "coverage/added/inner.py").write_text("from jaxtyping import Float\n")
    (house / "coverage/outer.py").write_text("from .added.inner import Float\n")
    return house


def test_a_new_file_and_a_new_sub_room_need_no_edit_anywhere_but_obey_the_rules(house):
    assert "place_rings.coverage.added" in installed(house)["packages"]
    assert not list(wrong_arrows("coverage", house))
    assert not [folder for folder in folders(house) if circle(folder, house)]
    assert set(shaped_modules(house)) - set(shaped_modules()) == {
        "place_rings.coverage.added.inner"
    }
    assert TYPES["installed_modules"](house) == dict(modules(house))
    imports.cache_clear()
    (house / "coverage/added/inner.py").write_text(
        "from ..outer import Float\nfrom ...cli import app\n"
    )
    assert circle(house / "coverage", house) == ["added", "outer"]
    assert list(wrong_arrows("coverage", house)) == ["coverage/added/inner.py imports cli"]
