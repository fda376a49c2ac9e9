"""The entries of the benchmark, scored again, with published layouts out of competition."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...coverage.rings.ring import Setup
from ...formats.layouts.entry_csv import EntryModel, read_entry
from ...objectives.named_layouts import layout_in
from ..engine.runner import register
from ..engine.scenes import Rings, setup_from, setup_keys
from ..engine.store import Cell, Measure
from ..layouts.study import PUBLISHED
from .entries import ENTRIES
from .questions import QUESTIONS, Question
from .score import AnswerScore, score

OUTSIDE = (
    ("blind", "n2_16_55", "Kumar and Sahin, n2_16_55"),
    ("shell_far", "n3_16_55", "Kumar and Sahin, n3_16_55"),
    ("panda_pads", "gentact_fr3_12356.csv", "GenTact skin, links 1, 2, 3, 5, 6"),
    ("panda_strip", "woomessi_strip.csv", "Woomessi, a strip on link 1"),
)
"""Published layouts that break a rule of a question: the question, the layout of the paper or the
file of the published layout, and the name in tables."""


@dataclass(frozen=True)
class ScoredEntry:
    """An answer of an entry with its score."""

    entry: str
    """Name in tables."""
    equal: bool
    """Whether it had the equal budget of processor time."""
    seconds: float | None
    """Processor time that it took, s."""
    stated: float | None
    """The value that its file states, percent."""
    score: AnswerScore
    """The score."""


@register("benchmark score")
def scored(question: str, fingerprint: str, setup: Rings | Mapping[str, Any]) -> dict[str, Any]:
    """Return the score of a setup as JSON data; ``fingerprint``: that of the question."""
    asked = QUESTIONS[question]
    if fingerprint != asked.fingerprint:
        raise ValueError(f"another question is called {question}")
    found = vars(score(asked, setup_from(setup, asked.scene)))
    return {key: value for key, value in found.items() if key != "question"}


@dataclass(frozen=True)
class _Answer:
    """An answer, before it is scored."""

    entry: str
    equal: bool
    about: EntryModel
    question: Question
    setup: Setup

    @property
    def cell(self) -> Cell:
        """The measurement of its score."""
        question = self.question
        asked = {"question": question.name, "fingerprint": question.fingerprint}
        return Cell("benchmark score", asked | {"setup": setup_keys(self.setup, question.scene)})


def _answers() -> Iterator[_Answer]:
    """Yield the answers of all entries, and the layouts out of competition, by question."""
    for name, question in QUESTIONS.items():
        scene = question.scene
        for entry in ENTRIES.values():
            if (file := entry.file(name)).exists():
                about, setup = read_entry(file, scene)
                yield _Answer(entry.title, entry.equal, about, question, setup)
        for layout, title in [(layout, title) for q, layout, title in OUTSIDE if q == name]:
            file = PUBLISHED / layout
            setup = read_entry(file, scene)[1] if file.exists() else layout_in(scene, layout)
            yield _Answer(title, False, EntryModel(), question, setup)


def measure(run: Measure) -> list[ScoredEntry]:
    """Return all answers with their scores.

    Args:
        run: measures cells under a heading.
    """
    answers = list(_answers())
    found = run("scoring answers", [answer.cell for answer in answers])
    return [
        ScoredEntry(
            answer.entry,
            answer.equal,
            answer.about.processor_s,
            answer.about.percent,
            AnswerScore(answer.question.name, **result | {"broken": tuple(result["broken"])}),
        )
        for answer, result in zip(answers, found, strict=True)
    ]
