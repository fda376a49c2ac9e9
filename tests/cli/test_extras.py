"""The core is enough for most commands; the others say which extra they need."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions

import pytest

from ..support.rooms import ROOT, modules

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
EXTRAS = PROJECT["project"]["optional-dependencies"]


RTDE = ("control", "receive")  # modules without Python files, and on 3.13 not there


def names(requirements):
    """The distributions of requirements, normalised, with those of our own extras."""
    for requirement in requirements:
        name = re.match(r"[\w.-]+", requirement)[0]
        if name == "place-rings":
            for extra in re.search(r"\[(.*)\]", requirement)[1].split(","):
                yield from names(EXTRAS[extra])
        else:
            yield re.sub(r"[-_.]+", "-", name).lower()


PROPOSAL = ROOT / "results/robots/ur10_shadow.toml"
CORE = set(names(PROJECT["project"]["dependencies"]))
BAGS, CLUSTER, RIG, ALL = (set(names(EXTRAS[name])) for name in ("bags", "cluster", "rig", "all"))


def imported(path):
    """The third-party modules that a file names in its import statements."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


def test_all_that_is_imported_is_declared_and_what_is_rare_is_an_extra():
    homes = packages_distributions() | {f"rtde_{part}": ["ur-rtde"] for part in RTDE}
    by_room = {}
    for _, path in modules():
        tops = set(imported(path)) - sys.stdlib_module_names - {"place_rings", "pydantic_core"}
        dists = {
            re.sub(r"[-_.]+", "-", dist).lower() for top in tops for dist in homes.get(top, [top])
        }
        room = path.relative_to(ROOT).parts[0]
        by_room.setdefault(room, set()).update(dists)
    used = set().union(*by_room.values())
    assert used <= CORE | BAGS | CLUSTER | RIG
    assert {room for room, dists in by_room.items() if dists & BAGS} == {"rig", "formats"}
    assert {room for room, dists in by_room.items() if dists & CLUSTER} == {"studies"}
    assert {room for room, dists in by_room.items() if dists & RIG} == {"rig"}
    assert CORE - used == {"pycollada"}  # by it trimesh reads COLLADA


def test_all_the_features_are_in_all_and_what_tests_need_is_in_test():
    assert BAGS | CLUSTER | RIG | set(names(EXTRAS["robots"])) == ALL
    assert set(names(EXTRAS["test"])) >= BAGS | CLUSTER | RIG


WITHOUT = """
import sys
for name in ("dask", "distributed", "cryptography", "serial", "rtde_control", "rtde_receive",
             "rosbags", "lz4", "backports"):
    sys.modules[name] = None  # as if it were not installed
sys.argv = ["place-rings", *sys.argv[1:]]
from place_rings.cli.entry import main
main()
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            "study convergence --workers 2 --out made",
            "--workers: needs dask, distributed, cryptography, not installed:"
            " pip install 'place-rings[cluster]'",
        ),
        (
            "study paper --scheduler tcp://127.0.0.1:9 --out made",
            "--scheduler: needs dask, distributed, cryptography, not installed:"
            " pip install 'place-rings[cluster]'",
        ),
        (
            f"check {PROPOSAL} --rig sim --out made",
            "check: needs rtde_receive, rtde_control, serial, not installed:"
            " pip install 'place-rings[rig]' on Python 3.11 or 3.12",
        ),
        (
            f"check {PROPOSAL} --joints rig.mcap --out made",
            "--joints rig.mcap: needs rosbags, not installed: pip install 'place-rings[bags]'",
        ),
        (
            "check --replay recording-1.rig --bag --out made",
            "--bag: needs rosbags, not installed: pip install 'place-rings[bags]'",
        ),
    ],
)
def test_a_command_without_its_extra_says_what_to_install(arguments, line, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, *arguments.split()],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout, list(tmp_path.iterdir())) == (2, "", [])
    assert done.stderr.removeprefix("place-rings: ").strip() == line


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments",
    [
        "--target V_S --radius 0.5 --sensors 16 --time 2 --voxel 0.05",
        "report n1_8_0 --target V_S --radius 0.5 --voxel 0.05",
        "verify n1_8_0 --target V_S --radius 0.5 --voxel 0.05",
    ],
)
def test_the_core_is_enough(arguments, tmp_path):
    subprocess.run(
        [sys.executable, "-c", WITHOUT, *arguments.split()],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        timeout=300,
    )


def test_pytest_starts_beside_a_plugin_of_dash_that_warns(tmp_path):
    """As where ``[test,bench]`` is installed: open3d brings dash, whose plugin warns as pytest
    loads it.
    """
    info = tmp_path / "dash-0.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: dash\nVersion: 0.0\n")
    (info / "entry_points.txt").write_text("[pytest11]\ndash = dash_plugin_that_warns\n")
    (tmp_path / "dash_plugin_that_warns.py").write_text("raise DeprecationWarning('old')\n")
    options = ["-n0", "--noconftest", "--collect-only", "tests/test_sensor_lists.py"]
    code = f"import sys, pytest; sys.exit(pytest.main({options}))"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
