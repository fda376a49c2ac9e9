"""Pages of studies, from their templates, and the file of a study's setups: a TOML table for each,
which holds a whole proposal."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from ...coverage.definitions.records import FILE_VERSION
from ...formats.writing import without_none
from .scenes import Rings

FILE = "setups.toml"
USE = f"place-rings verify {FILE}:NAME"
"""Command that counts the proposal with a name."""
HOW = f"Each table of `{FILE}` is a proposal. To count one again:\n\n```bash\n{USE}\n```\n"
"""Paragraph for the pages of studies that write setups."""
PAPERS_WORLD = "As in the paper, beams pass through the robot, and rings need no room on it."
"""Sentence for the pages of studies in the paper's scene."""


def page(study: str, **values: object) -> str:
    """Return the page of a study as Markdown: its template with values in place of their names."""
    template = Path(__file__).parents[1] / study / "page.md"
    return template.read_text("utf-8").format(**{"world": PAPERS_WORLD, "how": HOW} | values)


def setups_toml(setups: Mapping[str, tuple[Rings, Mapping[str, Any]]]) -> str:
    """Return the file.

    Args:
        setups: rings as in a proposal, and the keys of their scene, by name.
    """
    tables = {
        name: {"version": FILE_VERSION, "rings": rings, "scene": dict(scene)}
        for name, (rings, scene) in setups.items()
    }
    text = tomli_w.dumps(without_none(tables))
    return f"# Each table is a proposal. To count one again: {USE}\n\n{text}"
