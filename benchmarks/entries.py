"""Answers of our search and of other optimisers to the questions of the benchmark, each in a
process of its own with an equal budget of processor time.

Run: python benchmarks/entries.py                  all that is not there yet
     python benchmarks/entries.py ENTRY QUESTION   one answer

An answer is a file in studies/benchmark/entries. One that exists is not computed again.
"""

import subprocess
import sys
import time
from pathlib import Path

from common import installed, say
from peers import PEERS, SEARCHING, answer
from place_rings.coverage.rings.ring import Setup
from place_rings.formats.layouts.entry_csv import EntryModel, entry_csv
from place_rings.formats.writing import write_text
from place_rings.objectives.criterion import judge
from place_rings.objectives.named_layouts import layout_in
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.search import search
from place_rings.placement.space.design import Space
from place_rings.placement.stop_token import StopToken
from place_rings.studies.benchmark.entries import ENTRIES, SECONDS, Entry
from place_rings.studies.benchmark.questions import QUESTIONS, VERSION, Question
from place_rings.studies.benchmark.score import VOXEL, broken_rules

SEED = 0
EFFORT = 0.1  # of our search within the budget: its smallest, for a quick look
_PAPERS = {80: "n2_16_55", 112: "n3_16_55"}  # best layouts of the paper, by their sensors


def ours(question: Question, seconds: float | None, seed: int = SEED) -> Setup:
    """Return the answer of our search; ``seconds``: its budget, None without one."""
    space = Space(question.scene, sensors=question.sensors)
    brake = StopToken() if seconds is None else StopToken(SEARCHING * seconds, time.process_time)
    context = SearchContext(Verifier(question.scene, VOXEL), question.aim, brake=brake)
    options = SearchOptions(seed=seed, effort=1.0 if seconds is None else EFFORT)
    return search(space, options, context).setup


def found(entry: Entry, question: Question) -> Setup:
    """Return the answer of an entry to a question."""
    if entry.name == "place-rings":
        return ours(question, SECONDS)
    if entry.name == "kumar-sahin":
        return layout_in(question.scene, _PAPERS[question.sensors])
    peer = PEERS[entry.name][1]
    scene, sensors, aim = question.scene, question.sensors, question.aim
    return answer(peer, scene, sensors, aim, SEED, SECONDS, VOXEL)


def takes_part(entry: Entry, question: Question) -> bool:
    """Return whether an entry's answer to a question can be computed here: the paper's layouts
    answer those of its robot and world."""
    if entry.name in PEERS:
        return installed(PEERS[entry.name][0])
    paper = question.name.startswith("paper") and question.sensors in _PAPERS
    return entry.name == "place-rings" or (entry.name == "kumar-sahin" and paper)


def run(entry: Entry, question: Question, file: Path) -> None:
    """Find, count and write an answer."""
    began = time.process_time()
    setup = found(entry, question)
    spent = round(time.process_time() - began, 1)
    value = round(100 * judge(Verifier(question.scene, VOXEL), setup, question.aim)[1], 4)
    about = EntryModel(
        question=question.name,
        version=VERSION,
        by=entry.title,
        seed=SEED,
        processor_s=spent,
        percent=value,
    )
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(file, entry_csv(about, setup, question.scene))
    say(entry.name, question.name, value, f"{spent} s", *broken_rules(question, setup))


def main() -> None:
    """Compute what is asked for."""
    if len(sys.argv) == 3:
        entry, question = ENTRIES[sys.argv[1]], QUESTIONS[sys.argv[2]]
        run(entry, question, entry.file(question.name))
        return
    for entry in sorted(ENTRIES.values(), key=lambda entry: not entry.equal):
        for name, question in QUESTIONS.items():
            file = entry.file(name)
            if takes_part(entry, question) and not file.exists():
                subprocess.run([sys.executable, __file__, entry.name, name], check=False)


if __name__ == "__main__":
    main()
