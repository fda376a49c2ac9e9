"""Commands by rule: each file in cli/commands/ is one, declaring it loads nothing heavy, and the
docs name them all.
"""

import re
import shlex
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


def test_what_computes_no_gradient_loads_neither_jax_nor_scipy():
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
    assert not {"jax", "scipy", "matplotlib", "trimesh", "viser"} & shown


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


COMMANDS = sorted(name for name in app if not name.startswith("-"))


def help_text(name):
    """The text above the options, of a command or of the program."""
    return app.help if name is None else getdoc(app[name].default_command)


def examples(name):
    """The example commands, each as one line without its output file; comments are left out."""
    block = re.search(r"^```bash\n(.*?)^```", help_text(name), re.M | re.S)[1]
    lines = block.replace("\\\n", " ").splitlines()
    return [line.partition(" > ")[0] for line in lines if not line.startswith("#")]


EXAMPLES = [line for name in (None, *COMMANDS) for line in examples(name)]


def test_every_command_has_examples():
    assert all(examples(name) for name in (None, *COMMANDS))


@pytest.mark.parametrize("line", EXAMPLES)
def test_an_example_is_a_valid_command(line):
    first, *words = shlex.split(line)
    assert first == "place-rings"
    app.parse_args(words, exit_on_error=False, print_error=False)


@pytest.mark.parametrize("name", [None, *COMMANDS])
def test_every_option_is_explained(name):
    command = app if name is None else app[name]
    collection = command.assemble_argument_collection(parse_docstring=True)
    for argument in collection:
        if argument.show:
            text = argument.parameter.help or ""
            assert re.match(r"[A-Z]|sim:|pareto:|layouts:", text), (argument.name, text)
    options = {argument.name for argument in collection}
    if "--robot" in options and name != "task":  # the paper's robot alone
        assert options >= {"--packages", "--package", "--base", "--tip", "--hold"}


@pytest.mark.parametrize("name", [None, *COMMANDS])
def test_help_fits_the_window(name, run, monkeypatch):
    for columns in (60, 120):
        monkeypatch.setenv("COLUMNS", str(columns))
        code, out, _ = run(*([] if name is None else [name]), "--help")
        assert code == 0
        assert max(map(len, out.splitlines())) <= columns
        assert not re.search(r"\[default: (None|\(\))?\]", out)


def test_a_command_that_models_printed_rings_says_nothing_on_stderr(tmp_path):
    """The library of solids reports every solid that is not freed at the end of the process."""
    ring = '[[rings]]\nlink = "forearm"\nposition = 0.5\ncount = 3\n'
    text = f'version = 2\n{ring}[scene]\nsensor = {{ model = "vl53l1x" }}\n'
    (tmp_path / "one.toml").write_text(text)
    words = ["place-rings", "export", "one.toml", "--to", "urdf", "--out", "out"]
    code = f"import sys; sys.argv = {words}; from place_rings.cli.entry import main; main()"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
