"""A proposal: a setup with its scene, its coverage, and the search that found it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from ._errors import input_errors
from ._placement import Counted
from .coverage.rings.ring import Setup
from .coverage.rings.sensor_records import sensor_records
from .formats.schema.proposal_models import ProposalFile, SearchFile
from .formats.writing import to_toml, write_text
from .objectives.criterion import Criterion
from .objectives.object_bounds import SmallestObject
from .objectives.options import ObjectOptions
from .objectives.pose_subset import MANY
from .objectives.robustness import RingSensitivity
from .objectives.scene import Scene
from .objectives.verified import Verified
from .objectives.verify import VOXEL, Verifier
from .placement.bound.coverage_bound import CoverageBound
from .placement.search.progress import Outcome
from .placement.search.result import FewestRings, Reach, RepeatedSearch, SearchResult

_HEADING = """A placement of sensor rings, found by place-rings. Edit it freely, then check it \
again:
  place-rings verify proposal.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


@dataclass(frozen=True, repr=False)
class Proposal(Counted):
    """A setup with its scene, its coverage, and the search that found it.

    ``search`` returns a proposal, ``load`` reads one, and ``save`` writes one.
    """

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the search."""
    name: str = "proposal"
    """Name of the setup in tables and pictures."""
    found: SearchResult | None = None
    """Record of the search: of this one, or of the one in the proposal's file."""
    criterion: Criterion = field(default_factory=Criterion, kw_only=True)
    """What the search maximised."""
    reach: Reach | None = field(default=None, kw_only=True)
    """Coverage reached with each number of sensors, if the search minimised the sensors."""
    bound: CoverageBound | None = field(default=None, kw_only=True)
    """Upper bound on every layout of the same budget, for a search with ``gap``; without a value
    after Ctrl-C."""
    fewest: FewestRings | None = field(default=None, kw_only=True)
    """Results with each number of rings, if the search minimised the rings."""
    repeated: RepeatedSearch | None = field(default=None, kw_only=True)
    """Results of each of several searches; None for a single one."""
    verifier: Verifier | None = field(default=None, kw_only=True, compare=False)
    """Counter of the search; by default one with voxels of 0.01 m."""

    @property
    def search(self) -> SearchResult | None:
        """Result of the search; None for a proposal from a file."""
        return None if self.found is None or self.found.setup is None else self.found

    @property
    def seed(self) -> int:
        """Random seed of the search; of several searches that of the best."""
        return 0 if self.found is None else self.found.seed

    @property
    def command(self) -> str:
        """The call or the command that ran the search."""
        return "" if self.found is None else self.found.command

    @cached_property
    def each(self) -> tuple[Verified, ...]:  # type: ignore[override]
        """Counted ζ of each target and pose, with voxels of 0.01 m or those of the search."""
        known = {} if self.search is None else {v.target: v for v in self.search.verified}
        goals = self.scene.targets
        with input_errors():
            return tuple(
                known.get(g.target) or self._verifier.verify(self.setup, g.target) for g in goals
            )

    @property
    def rings_tried(self) -> dict[int, float]:
        """Counted value of the criterion in [0, 1] by the number of rings, for a search for the
        fewest rings; empty otherwise."""
        return {} if self.fewest is None else {r.rings: r.exact for r in self.fewest.tried}

    @property
    def searched(self) -> dict[int, float]:
        """Counted value of the criterion in [0, 1] by the random seed, for several searches; empty
        otherwise."""
        return {} if self.repeated is None else {r.seed: r.exact for r in self.repeated.records}

    @property
    def value(self) -> float | None:
        """Counted value of the search's criterion in [0, 1]; None for a proposal from a file."""
        return None if self.search is None else self.search.exact

    @property
    def gap(self) -> float | None:
        """Optimality gap in [0, 1]: no layout of the same budget exceeds ``value`` by more. It is
        None for a search without ``gap``, or after Ctrl-C."""
        return None if self.bound is None else self.bound.gap

    @property
    def outcome(self) -> Outcome | None:
        """How the search ended; None for a proposal from a file."""
        outcome = None if self.search is None else self.search.outcome
        return outcome if isinstance(outcome, Outcome) else None

    @cached_property
    def sensitivity(self) -> tuple[RingSensitivity, ...]:
        """What small errors of each ring cost in coverage, by millimetre and degree."""
        from .objectives.sensitivity import sensitivity  # loads JAX

        with input_errors():
            return sensitivity(self.scene, self.setup, self.seed) if self.setup.rings else ()

    @property
    def statistics(self) -> SearchResult | None:
        """Effort of the search, in its result; None for a proposal from a file."""
        return self.search

    @cached_property
    def objects(self) -> tuple[SmallestObject | None, ...]:
        """The largest unseen objects of each target that states the largest gap, with the verdict;
        None for other targets."""
        from .objectives.smallest_object import smallest_objects

        side = self._verifier.voxel or VOXEL
        with input_errors():
            return smallest_objects(self.scene, self.setup, side, ObjectOptions())

    @cached_property
    def records(self) -> tuple[Verified, ...]:
        """ζ of each target in percent under all occlusion models, as ``save`` writes it."""
        from .reporting.comparison import counted

        goals = [goal.target for goal in self.scene.targets]
        known = {(self.name, v.target): v for v in self.each}
        each = counted(self._verifier, {self.name: self.setup}, goals, goals, known)
        return tuple(self._with_objects(list(each)))

    def compare(self, progress: Callable[[int, int], None] | None = None) -> list[Verified]:
        """Count ζ of the proposal and of the paper's layouts for the scene's targets, by the same
        verifier.

        Ctrl-C ends the comparison and returns the finished counts.

        Args:
            progress: receives the number of counted poses, from 0, and the number of all.

        Returns:
            One record for each setup and target, in percent: the proposal under all models of
            occlusion, the others under the scene's and with a transparent robot.
        """
        from .reporting.comparison import counted_beside_papers

        counts = () if self.search is None else self.search.verified
        return counted_beside_papers(self._verifier, self.name, self.setup, counts, progress)

    def compare_criterion(self) -> dict[str, float]:
        """Return the search's criterion in percent for the proposal and the paper's layouts.

        The result is empty if the criterion is ζ itself. Ctrl-C returns the finished values.
        """
        from .reporting.comparison import judged_beside_papers

        if self.criterion.plain or self.search is None:
            return {}
        own = {self.name: self.search.exact}
        return judged_beside_papers(self.scene, self._verifier.voxel, self.criterion, own)

    def file(self, records: Sequence[Verified] | None = None) -> ProposalFile:
        """Return the model of the proposal's file; pass ``records`` if they are counted already."""
        core, zeta = self.scene, list(self.records if records is None else records)
        if len(core.poses) > MANY:
            zeta = [replace(r, poses=()) for r in zeta]
        return ProposalFile.of(
            self.setup,
            core,
            zeta=[replace(r, setup="proposal", beyond=None, people=None) for r in zeta],
            found=self.found,
        )

    def search_file(
        self,
        comparison: list[Verified],
        criterion_percent: dict[str, float],
        files: dict[str, str],
    ) -> SearchFile:
        """Return the model of ``result.json``: the proposal beside the paper's layouts.

        Args:
            comparison: records of ``compare``.
            criterion_percent: values of ``compare_criterion``.
            files: paths of the written files by their role.

        Raises:
            ValueError: for a proposal from a file.
        """
        if self.search is None:
            raise ValueError(
                "the proposal comes from a file; only a proposal of search has a result.json"
            )
        sampled = self.search.sampled
        own, stopped = self.own_records(comparison), self.outcome is Outcome.INTERRUPTED
        return SearchFile(
            proposal=self.file(own),
            soft_minus_exact_percent=(
                None if sampled is None else 100 * (sampled - self.search.exact)
            ),
            comparison=comparison,
            asked_percent=criterion_percent,
            files=files,
            sensitivity=[] if stopped else list(self.sensitivity),
            reach=self.reach,
            fewest_rings=self.fewest,
            searches=[] if self.repeated is None else self.repeated.records,
            gap=self.bound,
            price=self.scene.price_of(self.setup),
            short_percent=100 * self.search.short,
            sensors=sensor_records(self.setup),
        )

    def own_records(self, comparison: Sequence[Verified]) -> list[Verified]:
        """Return the records of a comparison that concern the proposal and its scene's targets,
        with the verdict on their largest gaps unless Ctrl-C came."""
        goals = {g.target.key for g in self.scene.targets}
        own = [r for r in comparison if r.setup == self.name and r.key in goals]
        return own if self.outcome is Outcome.INTERRUPTED else self._with_objects(own)

    def _with_objects(self, records: Sequence[Verified]) -> list[Verified]:
        keys = [goal.target.key for goal in self.scene.targets]
        objects = dict(zip(keys, self.objects, strict=True))
        return [replace(r, smallest_object=objects[r.key]) for r in records]

    def save(self, path: str | Path) -> Path:
        """Write the proposal as TOML. The write is atomic: an interruption leaves the old file or
        the new one.

        Args:
            path: path of the file; its folder must exist.

        Returns:
            The path of the file.

        Raises:
            InputError: if the file cannot be written.
        """
        with input_errors():
            write_proposal(Path(path), self.file())
        return Path(path)

    def rows(self) -> Iterable[Sequence[str]]:
        yield from super().rows()
        if self.bound is not None and self.bound.value is not None:
            yield "upper bound", f"{100 * self.bound.value:.2f} %"
        if self.outcome is not None:
            yield "search", self.outcome.value

    def _criterion_rows(self) -> Iterable[Sequence[str]]:
        if not self.criterion.plain and self.value is not None:
            yield str(self.criterion), f"{100 * self.value:.2f} %"


def write_proposal(path: Path, file: ProposalFile) -> None:
    """Write a proposal's file below its heading.

    Raises:
        UserError: if the file cannot be written.
    """
    write_text(path, proposal_text(file))


def proposal_text(file: ProposalFile) -> str:
    """Return a proposal's file as TOML, below its heading."""
    return to_toml(file, _HEADING)
