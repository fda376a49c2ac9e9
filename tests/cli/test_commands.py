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


def loaded(statement: str) -> list[set[str]]:
    """The modules that a fresh process has loaded at each ``loaded()`` in ``statement``, and at its
    end."""
    code = f"import sys\ndef loaded():\n    print('\\nloaded', *sys.modules)\n{statement}\nloaded()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    return [set(line.split()) for line in lines if line.startswith("loaded ")]


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


def test_a_command_loads_no_other_and_declaring_loads_nothing_heavy():
    one, every = loaded(
        "from importlib import import_module\n"
        "from place_rings.cli.app import app\n"
        "app['verify']\n"
        "loaded()\n"
        f"for name in {FILES}:\n    import_module(f'{commands.__name__}.{{name}}')"
    )
    ours = {name for name in one if name.startswith(f"{commands.__name__}.")}
    assert ours == {f"{commands.__name__}.{name}" for name in ("place", "verify")}
    assert not HEAVY & every


def test_what_computes_no_gradient_loads_no_jax():
    words = "robots, sensors, schema scene, cones n1_4_0, verify n1_4_0 --target V_S:0.5 --voxel .1"
    shown, _ = loaded(
        "from place_rings.cli.app import main\n"
        f"for words in {words.split(', ')}:\n"
        "    sys.argv = ['place-rings', *words.split()]\n"
        "    try:\n        main()\n"
        "    except SystemExit as stop:\n        assert not stop.code, words\n"
        "loaded()"
    )
    assert "place_rings.cli.app" in shown
    assert not {"jax", "scipy.stats", "matplotlib", "trimesh", "viser"} & shown


FOLLOWED = """
import sys, nlopt
from place_rings.objectives.soft_coverage import SoftCoverage
values, ended, real, optimize = [], [], SoftCoverage.value_and_slope, nlopt.opt.optimize
def counted(*args):
    values.append(real(*args))
    return values[-1]
def finished(*args):
    ended.append(optimize(*args))
    return ended[-1]
SoftCoverage.value_and_slope, nlopt.opt.optimize = counted, finished
from place_rings.cli.app import main
sys.argv = ["place-rings", "--sensors", "24", "--any-rings", "--voxel", "0.05"]
try:
    main()
except SystemExit as stop:
    assert not stop.code
assert "jax" in sys.modules
print(sum(bool(slope.any()) for _, slope in values), len(ended))
"""


@pytest.mark.slow
def test_a_search_follows_jaxs_gradient_and_ends_in_nlopt():
    """In the process of a command: nlopt evaluates values with gradients that are not 0."""
    done = subprocess.run([sys.executable, "-c", FOLLOWED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    followed, ended = map(int, done.stdout.split()[-2:])
    assert followed >= 3
    assert ended >= 1


def test_help_lists_each_command_by_its_first_sentence(run):
    code, out, _ = run("--help")
    assert code == 0
    listed = " ".join(re.sub(r"[│╭╮╰╯─]", " ", out).split())
    for name in sorted(set(FILES) - {"place"}):
        first = " ".join((getdoc(app[name].default_command) or "").split("\n\n")[0].split())
        assert first[:20] in listed, name
