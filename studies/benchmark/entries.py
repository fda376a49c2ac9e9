"""The entries of the benchmark: a folder of answers each, one file for each question."""

from dataclasses import dataclass
from pathlib import Path

from ...formats.layouts.entry_csv import EntryModel, read_head
from .questions import QUESTIONS

FOLDER = Path(__file__).parent / "entries"
"""Folder of the entries that the package brings."""
SECONDS = 20.0
"""The equal budget: processor time of an answer, s."""


@dataclass(frozen=True)
class Entry:
    """Answers of one method or author."""

    name: str
    """Name of its folder."""
    title: str
    """Name in tables."""
    equal: bool = False
    """Whether it had the equal budget of processor time."""

    def file(self, question: str) -> Path:
        """Return the path of its answer to a question."""
        return FOLDER / self.name / f"{question}.csv"

    @property
    def heads(self) -> dict[str, EntryModel]:
        """What its files state about the answers, by question."""
        files = ((name, self.file(name)) for name in QUESTIONS)
        return {name: read_head(file) for name, file in files if file.exists()}


_KNOWN = {
    entry.name: entry
    for entry in (
        Entry("place-rings", "place-rings", True),
        Entry("greedy", "greedy", True),
        Entry("cma-es", "CMA-ES", True),
        Entry("differential-evolution", "differential evolution", True),
        Entry("crs2", "CRS2", True),
        Entry("kumar-sahin", "Kumar and Sahin"),
    )
}
_OTHERS = sorted({folder.name for folder in FOLDER.iterdir() if folder.is_dir()} - set(_KNOWN))
ENTRIES = _KNOWN | {name: Entry(name, name) for name in _OTHERS}
"""The entries by name: those above, then each other folder, without the equal budget."""


def standings() -> dict[str, dict[str, float]]:
    """Return the stated values of all entries by question and title, percent, the best first."""
    heads = [(entry.title, entry.heads) for entry in ENTRIES.values()]
    return {
        name: dict(
            sorted(
                ((title, each[name].percent or 0.0) for title, each in heads if name in each),
                key=lambda pair: -pair[1],
            )
        )
        for name in QUESTIONS
    }
