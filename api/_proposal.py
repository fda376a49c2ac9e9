"""A proposal: a setup with its scene, its coverage, and the search that found it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from ._errors import input_errors
from ._placement import Placement, dark_captions, dark_rows, part_rows
from ._scene import Scene
from ._versions import versions
from .coverage.rings.ring import Setup
from .coverage.rings.sensor_records import sensor_records
from .formats.schema.gap_models import GapModel
from .formats.schema.price_models import PriceModel
from .formats.schema.proposal_models import (
    FewestRingsModel,
    FoundModel,
    ProposalFile,
    ReachModel,
    RepeatedModel,
    SearchFile,
)
from .formats.writing import to_toml, write_text
from .objectives.criterion import Criterion
from .objectives.dark_clothing import judge_dark, verify_dark
from .objectives.pose_subset import MANY
from .objectives.robustness import RingSensitivity
from .objectives.verified import Verified
from .objectives.verify import Verifier
from .objectives.verify_breakdown import mean_by_part
from .placement.bound.coverage_bound import CoverageBound
from .placement.search.progress import Outcome, Statistics
from .placement.search.result import FewestRings, Reach, RepeatedSearch, SearchResult
from .reporting.text import with_error

_HEADING = """A placement of sensor rings, found by place-rings. Edit it freely, then check it \
again:
  place-rings verify proposal.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


@dataclass(frozen=True, repr=False)
class Proposal(Placement):
    """A setup with its scene, its coverage, and the search that found it.

    ``search`` returns a proposal, ``load`` reads one, and ``save`` writes one.
    """

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the search."""
    name: str = "proposal"
    """Name of the setup in tables and pictures."""
    search: SearchResult | None = None
    """Result of the search; None for a proposal from a file."""
    criterion: Criterion = field(default_factory=Criterion)
    """What the search maximised."""
    seed: int = 0
    """Random seed of the search; of several searches that of the best."""
    reach: Reach | None = None
    """Coverage reached with each number of sensors, if the search minimised the sensors."""
    wanted_percent: float | None = None
    """Coverage to reach with the fewest sensors, percent."""
    bound: CoverageBound | None = None
    """Upper bound on every layout of the same budget, for a search with ``gap``; None without, or
    after Ctrl-C."""
    fewest: FewestRings | None = None
    """Results with each number of rings, if the search minimised the rings."""
    command: str = ""
    """The call or the command that ran the search."""
    found: FoundModel | None = None
    """Record of the search in the proposal's file; None for a new proposal."""
    repeated: RepeatedSearch | None = field(default=None, kw_only=True)
    """Results of each of several searches; None for a single one."""
    gapped: bool = field(default=False, kw_only=True, compare=False, repr=False)
    """Whether an upper bound was requested."""
    verifier: Verifier | None = field(default=None, kw_only=True, compare=False)
    """Counter of the search; by default one with voxels of 0.01 m."""

    @cached_property
    def each(self) -> tuple[Verified, ...]:
        """Counted ζ of each target and pose, with voxels of 0.01 m or those of the search."""
        known = {} if self.search is None else {v.target: v for v in self.search.verified}
        goals = self.scene.core.targets
        with input_errors():
            return tuple(
                known.get(g.target) or self._verifier.verify(self.setup, g.target) for g in goals
            )

    @property
    def coverage(self) -> float:
        """Counted ζ in [0, 1]: the weighted mean over targets and poses, or the ζ of the worst pose
        if the scene has ``over_poses="worst"``.
        """
        return self._verifier.judged(self.each)[1]

    @property
    def dark_clothing(self) -> float | None:
        """``coverage`` with the sensors' range on dark clothing (17 %) at their light; None if a
        sensor has no figures of a catalogue.
        """
        return judge_dark(self._verifier, self._dark)

    @cached_property
    def _dark(self) -> tuple[Verified | None, ...]:
        goals = self.scene.core.targets
        with input_errors():
            return tuple(verify_dark(self._verifier, self.setup, g.target) for g in goals)

    @property
    def error(self) -> float | None:
        """Computed error of ``coverage``, in [0, 1]; see ``Coverage.error``."""
        return self._verifier.judged_error(self.each)

    @property
    def by_target(self) -> dict[str, float]:
        """ζ in [0, 1] of each target, by its name, such as ``V_S(0.5)``."""
        return {str(v.target): v.zeta for v in self.each}

    @cached_property
    def by_part(self) -> dict[str, float]:
        """ζ in [0, 1] of the rings, the single sensors and the sensors of the cell alone: the
        weighted mean over the targets. Empty unless there are several of these.
        """
        return mean_by_part(self._verifier, self.setup, self.each)

    @property
    def rings_tried(self) -> dict[int, float]:
        """Counted value of the criterion in [0, 1] by the number of rings, for a search for the
        fewest rings; empty otherwise."""
        return {} if self.fewest is None else {n: r.exact for n, r in self.fewest.tried.items()}

    @property
    def searched(self) -> dict[int, float]:
        """Counted value of the criterion in [0, 1] by the random seed, for several searches; empty
        otherwise."""
        if self.repeated is None:
            return {}
        return {seed: one.exact for seed, one in self.repeated.tried.items()}

    @property
    def value(self) -> float | None:
        """Counted value of the search's criterion in [0, 1]; None for a proposal from a file."""
        return None if self.search is None else self.search.exact

    @property
    def gap(self) -> float | None:
        """Optimality gap in [0, 1]: no layout of the same budget exceeds ``value`` by more. It is
        None for a search without ``gap``, or after Ctrl-C."""
        return None if self.bound is None or self.value is None else self.bound.value - self.value

    @property
    def outcome(self) -> Outcome | None:
        """How the search ended; None for a proposal from a file."""
        return None if self.search is None else self.search.outcome

    @cached_property
    def sensitivity(self) -> tuple[RingSensitivity, ...]:
        """What small errors of each ring cost in coverage, by millimetre and degree."""
        from .objectives.sensitivity import sensitivity  # loads JAX

        with input_errors():
            return sensitivity(self.scene.core, self.setup, self.seed) if self.setup.rings else ()

    @property
    def statistics(self) -> Statistics | None:
        """Effort of the search; None for a proposal from a file."""
        return None if self.search is None else self.search.statistics

    @cached_property
    def records(self) -> tuple[Verified, ...]:
        """ζ of each target in percent under all occlusion models, as ``save`` writes it."""
        from .reporting.comparison import counted

        goals = [goal.target for goal in self.scene.core.targets]
        known = {(self.name, v.target): v for v in self.each}
        return tuple(counted(self._verifier, {self.name: self.setup}, goals, goals, known))

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
        return judged_beside_papers(self.scene.core, self._verifier.voxel, self.criterion, own)

    def file(self, records: Sequence[Verified] | None = None) -> ProposalFile:
        """Return the model of the proposal's file; pass ``records`` if they are counted already."""
        core, zeta = self.scene.core, list(self.records if records is None else records)
        if len(core.poses) > MANY:
            zeta = [replace(r, poses=()) for r in zeta]
        return ProposalFile.of(
            self.setup,
            core,
            zeta=[replace(r, setup="proposal", beyond=None, people=None) for r in zeta],
            found=self.found or self._found(),
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
            reach=self.reach_record(),
            fewest_rings=self.rings_record(),
            searches=RepeatedModel.of(self.repeated),
            gap=GapModel.of(self.bound, self.search.exact, self.scene.core)
            if self.gapped
            else None,
            price=PriceModel.of(self.scene.core, self.setup),
            short_percent=100 * self.search.short,
            sensors=sensor_records(self.setup),
        )

    def own_records(self, comparison: Sequence[Verified]) -> list[Verified]:
        """Return the records of a comparison that concern the proposal and its scene's targets."""
        goals = {g.target.key for g in self.scene.core.targets}
        return [r for r in comparison if r.setup == self.name and r.key in goals]

    def reach_record(self) -> ReachModel | None:
        """Return the searches for the fewest sensors in percent; None if there were none."""
        if self.reach is None or self.wanted_percent is None:
            return None
        return ReachModel.of(self.reach, self.wanted_percent)

    def rings_record(self) -> FewestRingsModel | None:
        """Return the searches for the fewest rings in percent; None if there were none."""
        return None if self.fewest is None else FewestRingsModel.of(self.fewest, self.scene.core)

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

    def captions(self) -> list[str]:
        return dark_captions(self.each, self._dark)

    def rows(self) -> Iterable[Sequence[str]]:
        for v in self.each:
            yield str(v.target), f"{with_error(100 * v.zeta, v.error)} %"
        yield from dark_rows(self._dark)
        if len(self.each) > 1:
            yield "weighted mean", f"{with_error(100 * self.coverage, self.error)} %"
        if not self.criterion.plain and self.value is not None:
            yield str(self.criterion), f"{100 * self.value:.2f} %"
        yield from part_rows(self.by_part)
        yield from self.price_rows()
        if self.bound is not None:
            yield "upper bound", f"{100 * self.bound.value:.2f} %"
        if self.outcome is not None:
            yield "search", self.outcome.value

    @cached_property
    def _verifier(self) -> Verifier:
        return Verifier(self.scene.core) if self.verifier is None else self.verifier

    def _found(self) -> FoundModel | None:
        if self.search is None:
            return None
        found = FoundModel.of(self.search, self.seed, self.criterion, self.command, versions())
        if self.bound is None or not self.bound.informative:
            return found
        return found.model_copy(update={"bound_percent": round(100 * self.bound.value, 2)})


def write_proposal(path: Path, file: ProposalFile) -> None:
    """Write a proposal's file below its heading.

    Raises:
        UserError: if the file cannot be written.
    """
    write_text(path, to_toml(file, _HEADING))
