"""Sphinx extension for the pages: links to files outside the docs, such as ``../results``, become
downloads, and bars in docstrings stay bars.
"""

import re
from typing import Any

from sphinx.application import Sphinx

_OUTSIDE = re.compile(
    r"(?<!!)\[((?!!)[^\]\n]+)\]"
    r"\(((?:\.\./)+(?:results/|README|CHANGELOG|benchmarks)[^)#\s]*)[^)\s]*\)"
)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the replacement to the reading of pages."""
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _plain)
    return {"parallel_read_safe": True}


def _read(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = _OUTSIDE.sub(_download, source[0])


def _download(link: re.Match[str]) -> str:
    label = link[1].replace("`", "")  # code cannot stand inside a role
    return f"{{download}}`{label} <{link[2]}>`"


def _plain(*event: Any) -> None:
    """Escape the bars in docstrings: they are lengths, |v|, and not substitutions."""
    lines = event[-1]
    lines[:] = [line if "``" in line else line.replace("|", r"\|") for line in lines]
