"""Pages made from the code: the commands, and the keys of every file.

A mark on a page, ``<!-- commands -->`` or ``<!-- keys: scene -->``, is replaced as Sphinx reads the
page. Links to files outside the docs, such as ``../results``, become downloads.
"""

import re
import sys
from typing import Any
from unittest.mock import patch

from cyclopts.docs.markdown import generate_markdown_docs
from keys import KeyTables
from place_rings.cli.app import app as commands
from sphinx.application import Sphinx

_COMMANDS = "<!-- commands -->"
_KEYS = re.compile(r"^<!-- keys: (\w+) -->$", re.MULTILINE)
_OUTSIDE = re.compile(
    r"(?<!!)\[([^\]\n]+)\]\(((?:\.\./)+(?:results/|README|CHANGELOG|benchmarks)[^)#\s]*)[^)\s]*\)"
)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the replacement to the reading of pages."""
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _plain)
    return {"parallel_read_safe": True}


def _read(app: Sphinx, page: str, source: list[str]) -> None:
    text = source[0]
    if _COMMANDS in text:
        text = text.replace(_COMMANDS, command_sections())
    if _KEYS.search(text):
        tables = KeyTables()
        text = _KEYS.sub(lambda found: tables.of(found[1]), text)
    source[0] = _OUTSIDE.sub(r"{download}`\1 <\2>`", text)


def _plain(*event: Any) -> None:
    """Escape the bars in docstrings: they are lengths, |v|, and not substitutions."""
    lines = event[-1]
    lines[:] = [line if "``" in line else line.replace("|", r"\|") for line in lines]


def command_sections() -> str:
    """Return all commands with their options as Markdown."""
    commands.resolved_commands()  # loads the docstrings that the list of commands shows
    with patch.object(sys, "argv", ["place-rings"]):  # the usage line begins with this name
        return generate_markdown_docs(
            commands, heading_level=2, no_root_title=True, generate_toc=False
        )
