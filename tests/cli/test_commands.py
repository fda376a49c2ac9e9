"""Commands by rule: each file in cli/commands/ is one, declaring it loads nothing heavy, and the
docs name them all.
"""

import re
import subprocess
import sys
from inspect import getdoc
from pathlib import Path

import pytest
from place_rings.cli import commands
from place_rings.cli.app import app

from ..support.rooms import ROOT

FILES = sorted(
    file.stem for file in Path(commands.__path__[0]).glob("*.py") if file.stem != "__init__"
)
HEAVY = {"jax", "matplotlib", "numpy", "pydantic", "scipy", "trimesh", "viser"}


def loaded(statement: str) -> set[str]:
    """The modules that a fresh process has loaded after ``statement``."""
    return set(
        subprocess.run(
            [sys.executable, "-c", f"{statement}\nimport sys\nprint(*sys.modules, sep='\\n')"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
    )


def test_every_file_is_a_command():
    names = {name for name in app if not name.startswith("-")}
    assert names | {"place"} == set(FILES)
    for name in names:
        assert app[name].default_command.__name__ == name
        assert app[name].default_command.__module__.endswith(f"commands.{name}")


def test_every_command_of_the_docs_is_there():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    called = {
        name
        for page in pages
        for block in re.findall(r"^```bash.*?\n(.*?)^```", page.read_text(), re.M | re.S)
        for name in re.findall(r"^place-rings ([a-z]+)", block, re.M)
    }
    assert called >= {"verify", "view", "report", "export", "check"}
    assert called <= set(FILES)


@pytest.mark.parametrize("name", ["place", "verify", "check", "export"])
def test_declaring_a_command_loads_nothing_heavy(name):
    seen = loaded(f"from place_rings.cli.app import app\nimport place_rings.cli.commands.{name}")
    assert not HEAVY & seen


def test_a_command_loads_no_other():
    seen = loaded("from place_rings.cli.app import app\napp['verify']")
    ours = {name for name in seen if name.startswith(f"{commands.__name__}.")}
    assert ours == {f"{commands.__name__}.{name}" for name in ("place", "verify")}


@pytest.mark.parametrize(
    "words",
    [
        ("robots",),
        ("sensors",),
        ("schema", "scene"),
        ("cones", "n1_4_0"),
        ("verify", "n1_4_0", "--target", "V_S", "--radius", "0.5", "--voxel", "0.05"),
    ],
    ids=" ".join,
)
def test_what_computes_no_gradient_loads_no_jax(words):
    seen = loaded(
        f"import sys\nsys.argv = {['place-rings', *words]}\n"
        "from place_rings.cli.app import main\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code"
    )
    assert "place_rings.cli.app" in seen
    assert not {"jax", "scipy.stats", "matplotlib", "trimesh", "viser"} & seen


def test_help_lists_each_command_by_its_first_sentence(run):
    code, out, _ = run("--help")
    assert code == 0
    listed = " ".join(re.sub(r"[│╭╮╰╯─]", " ", out).split())
    for name in sorted(set(FILES) - {"place"}):
        first = " ".join((getdoc(app[name].default_command) or "").split("\n\n")[0].split())
        assert first[:20] in listed, name


def test_a_search_loads_no_jax():
    """JAX takes longer to load than the first rounds take to run."""
    seen = loaded(
        "from place_rings.objectives.scene import CoreScene\n"
        "from place_rings.placement.search.design import Space\n"
        "from place_rings.placement.search.round import Round\n"
        "from place_rings.placement.search.search import search\n"
        "scene = CoreScene()\n"
        "search(scene, Space(scene, sensors=24), schedule=(Round(256, 2, 1, 2, 0.1),), voxel=0.1)"
    )
    assert "place_rings.placement.search.search" in seen
    assert not {"jax", "nlopt"} & seen
