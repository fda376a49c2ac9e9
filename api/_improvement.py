"""Changes to a mounted setup: the proposals of a redesign, its record and its files."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from ._errors import new_files
from ._pictures import Picture, drawn
from ._placement import Placement
from ._proposal import Proposal
from ._versions import origin
from .coverage.rings.ring import Setup
from .coverage.rings.rounding import of_scene
from .formats.schema.proposal_models import ProposalFile
from .formats.schema.redesign_models import ImproveResult
from .formats.writing import to_toml, write_text
from .objectives.scene import Scene
from .objectives.verified import Verified
from .objectives.verify import Verifier
from .placement.redesign import redesign
from .placement.redesign.changes import Answer
from .placement.search.progress import Outcome
from .placement.search.result import SearchResult
from .reporting.text import counted

_RECORD, _PICTURE = "improve.json", "improve.png"


@dataclass(frozen=True, repr=False)
class Improvement(Placement):
    """Changes to a mounted setup: the best single change, the best two, and so on.

    As a result, it stands for the setup after the last step.
    """

    mounted: str
    """Name of the mounted setup."""
    scene: Scene
    """Scene of the search."""
    result: redesign.Improved
    """Result of the search."""
    changes: int
    """Largest number of changes of the search."""
    add_sensors: int
    """Largest number of additional sensors."""
    seed: int
    """Random seed of the search."""
    command: str = ""
    """The call or the command that ran the search."""
    verifier: Verifier = field(kw_only=True, compare=False)
    """The counter."""

    @property
    def setup(self) -> Setup:  # type: ignore[override]
        """The rings after the last step; the mounted rings if no change helps."""
        return self._last.setup

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name of the mounted setup with the number of changes."""
        return self._label(self._last)

    @property
    def before(self) -> float:
        """Counted ζ of the mounted setup in [0, 1], defined as ``coverage`` is."""
        return self.result.mounted.exact

    @property
    def coverage(self) -> float:
        """Counted ζ in [0, 1] after the last step: the weighted mean over targets and poses, or the
        ζ of the worst pose if the scene has ``over_poses="worst"``.
        """
        return self._last.exact

    @property
    def outcome(self) -> Outcome:
        """How the search ended."""
        return self.result.outcome

    @cached_property
    def steps(self) -> tuple[Proposal, ...]:
        """One proposal for each number of changes that justifies its work; empty if none does."""
        return tuple(
            Proposal(
                answer.setup,
                self.scene,
                self._label(answer),
                self._found(answer),
                verifier=self.verifier,
            )
            for answer in self.result.steps
        )

    @property
    def instructions(self) -> tuple[tuple[str, ...], ...]:
        """One line of text for each changed ring of each step: what to do to it."""
        robot = self.scene.robot
        return tuple(
            tuple(change.instruction(robot) for change in answer.changes)
            for answer in self.result.steps
        )

    @cached_property
    def record(self) -> ImproveResult:
        """Record that ``place-rings improve --json`` prints, with ζ of each target.

        Ctrl-C during its count leaves out the ζ of the remaining steps.
        """
        result, core = self.result, self.scene
        zetas = self._verified([result.mounted, *result.steps])
        return ImproveResult(
            setup=self.mounted,
            scene=core,
            most_changes=self.changes,
            add_sensors=self.add_sensors,
            outcome=result.outcome.value,
            seed=self.seed,
            seconds=result.seconds,
            exact_percent=100 * result.mounted.exact,
            short_percent=100 * result.mounted.short,
            rings=list(of_scene(result.mounted.setup, core.sensor).rings),
            zeta=zetas[0],
            broken=[fault.text for fault in result.broken],
            steps=[
                answer.in_file(result.mounted, core.sensor, zeta)
                for answer, zeta in zip(result.steps, zetas[1:], strict=True)
            ],
        )

    def plot(self, path: str | Path | None = None) -> Picture:
        """Draw the mounted setup beside the setup after the last step.

        Args:
            path: path of a PNG file; by default no file is written.

        Returns:
            The picture.

        Raises:
            InputError: if the file cannot be written.
        """
        from .reporting.placement_picture import comparison_picture
        from .reporting.tables import target_label

        zetas = self.record.steps[-1].zeta if self.record.steps else []
        goals = "   ·   ".join(
            f"{target_label(a)}: {100 * a.zeta:.1f} → {100 * b.zeta:.1f} %"
            for a, b in zip(self.record.zeta, zetas, strict=False)
        )
        captions = ("as mounted", f"after {_changes(len(self._last.changes))}")
        before, core = self.result.mounted.setup, self.scene
        return drawn(
            lambda file: comparison_picture(file, core, before, self.setup, captions, goals), path
        )

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write a proposal of each step, a picture and improve.json.

        Args:
            folder: output folder; created if it does not exist.

        Returns:
            The paths of the files.

        Raises:
            InputError: if the folder cannot be written.
        """
        out = Path(folder)
        with new_files(folder, *improvement_files(self.changes), keep=True) as new:
            record = write_improvement(self, new, out)
        return (*(Path(path) for path in record.files.values()), out / _RECORD)

    def captions(self) -> list[str]:
        return [f"{100 * self.coverage:.1f} % covered"]

    def rows(self) -> Iterable[Sequence[str]]:
        yield "as mounted", f"{100 * self.before:.2f} %"
        for answer in self.result.steps:
            yield _changes(len(answer.changes)), f"{100 * answer.exact:.2f} %"
        yield "search", self.outcome.value

    @property
    def _last(self) -> Answer:
        return (self.result.mounted, *self.result.steps)[-1]

    def _label(self, answer: Answer) -> str:
        changes = len(answer.changes)
        return f"{self.mounted}, {_changes(changes)}" if changes else self.mounted

    def _found(self, answer: Answer) -> SearchResult:
        result = self.result
        return SearchResult(
            setup=answer.setup,
            outcome=result.outcome,
            seed=self.seed,
            sampled=answer.soft,
            exact=answer.exact,
            width=result.width,
            starts=result.climbs,
            evaluations=result.evaluations,
            seconds=result.seconds,
            short=answer.short,
            **origin(self.command),
        )

    def _verified(self, answers: Sequence[Answer]) -> list[list[Verified]]:
        """Return ζ of each answer for each goal; empty lists for the answers after Ctrl-C."""
        core, records = self.scene, list[list[Verified]]()
        try:
            for answer in answers:
                counts = (self.verifier.verify(answer.setup, t.target) for t in core.targets)
                records.append([count.in_scene(self._label(answer), core) for count in counts])
        except KeyboardInterrupt:
            pass
        return records + [[]] * (len(answers) - len(records))


def improvement_files(changes: int) -> list[str]:
    """Return the names of the files of an improvement with at most so many changes."""
    proposals = (f"changes_{n}.toml" for n in range(1, changes + 1))
    return [*proposals, _RECORD, _PICTURE]


def write_improvement(improvement: Improvement, new: Path, folder: Path) -> ImproveResult:
    """Write a proposal of each step, improve.json and a picture.

    Args:
        improvement: the changes.
        new: existing folder to write into.
        folder: output folder that its files then move to.

    Returns:
        The record with the paths of its files.

    Raises:
        UserError: if a file cannot be written.
    """
    record, result = improvement.record, improvement.result
    files = {
        f"changes_{len(step.changes)}": folder / f"changes_{len(step.changes)}.toml"
        for step in record.steps
    }
    files |= {"picture": folder / _PICTURE} if record.steps else {}
    record = record.model_copy(update={"files": {k: str(path) for k, path in files.items()}})
    texts = improvement.instructions
    for answer, step, lines in zip(result.steps, record.steps, texts, strict=True):
        proposal = ProposalFile(
            rings=list(step.rings),
            scene=record.scene,
            zeta=list(step.zeta),
            found=improvement._found(answer),
        )
        n = len(step.changes)
        heading = "\n".join(
            (f"The mounted setup after {_changes(n)} (place-rings improve):", *lines)
        )
        write_text(new / files[f"changes_{n}"].name, to_toml(proposal, heading))
    write_text(new / _RECORD, record.model_dump_json(indent=2) + "\n")
    if record.steps:
        improvement.plot(new / _PICTURE)
    return record


def _changes(n: int) -> str:
    return counted(n, "change")
