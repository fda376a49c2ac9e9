"""List the questions of the benchmark, write their scenes, and score answers."""

import json
from collections.abc import Iterator
from pathlib import Path

from ...coverage.definitions.errors import UserError
from ...formats.layouts.entry_csv import entry_csv, read_head
from ...formats.writing import output_folder, write_text
from ...reporting.explained import Explained
from ...reporting.progress import late_progress
from ...reporting.terminal import Terminal, say_json
from ...studies.benchmark.entries import standings
from ...studies.benchmark.questions import QUESTIONS, VERSION, Question, question_named
from ...studies.benchmark.score import AnswerScore, scored_file

_FILES = (".csv", ".json", ".toml")
_RULES = (
    "sensors: at most this many, in rings with the scene's sensor that keep all rules of the scene"
    " (mounts, spacing, collisions, boards); best: percent, by whom. docs/benchmark.md states the"
    " rules; place-rings benchmark QUESTION --out FOLDER writes the scene."
)


def listed(name: str | None, out: Path | None, as_json: bool) -> None:
    """Print the questions, or one with its standings, and write their scenes into ``out``."""
    chosen = [question_named(name, "QUESTION")] if name else list(QUESTIONS.values())
    ranks = standings()
    if out is not None:
        for question in chosen:
            write_text(output_folder(out) / f"{question.name}.toml", question.file)
    if as_json:
        records = [_record(question, ranks[question.name]) for question in chosen]
        say_json(json.dumps(records, indent=2))
        return
    console = Terminal()
    console.print(
        Explained.of(
            f"Benchmark, version {VERSION}",
            ("question", "robot", "poses", "sensors", "best", "asks for"),
            [_row(question, ranks[question.name]) for question in chosen],
            _RULES,
            left=("question", "robot", "best", "asks for"),
        )
    )
    if name:
        for title, percent in ranks[name].items():
            console.lines(f"{percent:6.2f} %  {title}")
    if out is not None:
        console.lines(f"{out}: {', '.join(f'{question.name}.toml' for question in chosen)}")


def _row(question: Question, ranks: dict[str, float]) -> list[str]:
    scene, best = question.scene, next(iter(ranks.items()), None)
    poses = f"{len(scene.poses)}"
    return [
        question.name,
        scene.robot.name,
        poses,
        f"{question.sensors}",
        "-" if best is None else f"{best[1]:.2f} {best[0]}",
        question.title,
    ]


def _record(question: Question, ranks: dict[str, float]) -> dict[str, object]:
    return {
        "question": question.name,
        "title": question.title,
        "version": VERSION,
        "fingerprint": question.fingerprint,
        "robot": question.scene.robot.name,
        "sensors": question.sensors,
        "entries": ranks,
    }


def score(name: str | None, path: Path, out: Path | None, as_json: bool) -> int:
    """Print the scores of the answers in a file or a folder, and return the exit code: 1 if one
    breaks a rule."""
    pairs = list(_answers(name, path))
    scores, written = list[AnswerScore](), dict[str, str]()
    with late_progress(Terminal(stderr=True)) as bar:
        bar.start()
        task = bar.add_task("scoring answers", total=len(pairs))
        for question, file in pairs:
            about, setup, found = scored_file(question, file)
            scores.append(found)
            bar.advance(task)
            if out is not None and not found.broken:
                written[f"{question.name}.csv"] = entry_csv(about, setup, question.scene)
    for file_name, text in written.items():
        write_text(output_folder(out or path) / file_name, text)
    if as_json:
        records = [vars(found) | {"points": found.points} for found in scores]
        say_json(json.dumps(records, indent=2))
    else:
        _print(scores, folder=path.is_dir())
        if out is not None:
            Terminal().lines(f"{out}: {', '.join(written) or 'no answer that keeps the rules'}")
    return int(any(found.broken for found in scores))


def _answers(name: str | None, path: Path) -> Iterator[tuple[Question, Path]]:
    """Yield the answers in a file or a folder with their questions.

    Raises:
        UserError: if there is none, a file belongs to no question, or two to one.
    """
    if not path.is_dir():
        has_head = name is None and path.suffix.lower() == ".csv"
        stated = read_head(path).question if has_head else None
        yield question_named(name or stated or path.stem, "QUESTION" if name else str(path)), path
        return
    if name is not None:
        raise UserError(f"--score {path}: found a folder with QUESTION, allowed: a file")
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in _FILES)
    if not files:
        raise UserError(f"--score {path}: found no file, allowed: QUESTION.csv for each answer")
    for i, file in enumerate(files):
        if i and file.stem == files[i - 1].stem:
            raise UserError(
                f"{file}: found a second answer beside {files[i - 1].name}, allowed: one"
            )
        yield question_named(file.stem, str(file)), file


def _print(scores: list[AnswerScore], folder: bool) -> None:
    """Print a table of scores, the broken rules, and for a folder the mean over all questions."""
    ranks, rows, console = standings(), [], Terminal()
    for found in scores:
        best = next(iter(ranks[found.question].values()), 0.0)
        above = sum(value > found.points for value in ranks[found.question].values())
        rows.append(
            (
                found.question,
                f"{found.sensors}",
                f"{found.percent:.2f}",
                f"{found.low_percent:.2f} to {found.high_percent:.2f}",
                f"{found.points - best:+.2f}",
                "out of competition" if found.broken else f"{above + 1}",
            )
        )
    heads = ("question", "sensors", "percent", "proven interval", "to the best", "rank")
    text = (
        "percent: the value, counted in voxels of 1 cm; to the best: points above the best entry of"
        " the package; rank: among these entries."
    )
    console.print(Explained.of("Scores", heads, rows, text, left=("question", "rank")))
    for found in scores:
        console.lines(*(f"{found.question}: {line}" for line in found.broken))
    if folder:
        mean = sum(found.points for found in scores) / len(QUESTIONS)
        console.lines(
            f"{len(scores)} of {len(QUESTIONS)} questions answered; the mean over all is {mean:.2f}"
        )
