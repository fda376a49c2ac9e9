"""The help of all commands: options are explained, examples can be copied, lines fit the window."""

import re
import shlex
from inspect import getdoc

import pytest
from place_rings.cli.app import app

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
        assert "[default: None]" not in out
        assert "[default: ()]" not in out
