"""What pages say of the code is made from the code: the commands, and the keys of every file.

A page holds a mark in the place of what is made, ``<!-- commands -->`` or ``<!-- keys: scene -->``;
it is replaced as Sphinx reads the page. Links to files outside of these docs, like ``../results``,
become downloads.
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
    """Make what is to be made as pages are read."""
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
    """A docstring's bars are lengths, |v|, and no substitutions."""
    lines = event[-1]
    lines[:] = [line if "``" in line else line.replace("|", r"\|") for line in lines]


def command_sections() -> str:
    """All commands with their options, as Markdown."""
    with patch.object(sys, "argv", ["place-rings"]):  # a usage line begins with it
        return generate_markdown_docs(
            commands, heading_level=2, no_root_title=True, generate_toc=False
        )
