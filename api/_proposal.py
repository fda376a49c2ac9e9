"""A proposal: a setup with the scene that it was found for, its exact coverage, and how it was
found.
"""

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path

from ._errors import input_errors
from ._placement import Placement
from ._scene import Scene
from ._versions import versions
from .coverage.rings.ring import Setup
from .formats.schema.proposal_models import (
    FoundModel,
    ProposalFile,
    ReachedModel,
    ReachModel,
    SearchFile,
)
from .formats.schema.result_models import VerifyResult
from .formats.schema.robustness_models import ErrorsModel
from .formats.schema.sensor_records import sensor_records
from .formats.writing import to_toml, write_text
from .objectives.criterion import Criterion, judge
from .objectives.pose_subset import MANY
from .objectives.verify import Verified, Verifier
from .placement.search.fewest_sensors import Reach
from .placement.search.progress import Outcome, Statistics
from .placement.search.search import SearchResult

_HEADING = """A placement of sensor rings, found by place-rings. Edit it freely, then check it \
again:
  place-rings verify proposal.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


@dataclass(frozen=True, repr=False)
class Proposal(Placement):
    """A setup with the scene that it was found for, its exact coverage, and how it was found.

    ``search`` gives one, ``load`` reads one; ``save`` writes it.
    """

    setup: Setup
    """The rings."""
    scene: Scene
    """What the setup was found for."""
    name: str = "proposal"
    search: SearchResult | None = None
    """What the search gave; None for one that was read."""
    criterion: Criterion = field(default_factory=Criterion)
    """What the search made large."""
    seed: int = 0
    reach: Reach | None = None
    """What each number of sensors came to, where the fewest were sought."""
    wanted_percent: float | None = None
    """The coverage that these were to reach."""
    command: str = ""
    """The call or the command that found it."""
    found: FoundModel | None = None
    """How it was found, as its file says; None for one that was searched just now."""
    verifier: Verifier | None = field(default=None, kw_only=True, compare=False)

    @cached_property
    def each(self) -> tuple[Verified, ...]:
        """ζ of each target with its poses, counted on voxels of 0.01 m or those of the search."""
        known = {} if self.search is None else {v.target: v for v in self.search.verified}
        goals = self.scene.core.goals
        with input_errors():
            return tuple(
                known.get(g.target) or self._verifier.verify(self.setup, g.target) for g in goals
            )

    @property
    def coverage(self) -> float:
        """Exact ζ in [0, 1]: the weighted mean over targets and poses; the worst pose's where the
        scene asks for it.
        """
        return self._verifier.judged(self.each)[1]

    @property
    def by_target(self) -> dict[str, float]:
        """ζ in [0, 1] of each target, by its name, such as ``V_S(0.5)``."""
        return {str(v.target): v.zeta for v in self.each}

    @property
    def value(self) -> float | None:
        """The exact value in [0, 1] of what the search made large; None for one that was read."""
        return None if self.search is None else self.search.exact

    @property
    def outcome(self) -> Outcome | None:
        """How the search ended; None for one that was read."""
        return None if self.search is None else self.search.outcome

    @property
    def statistics(self) -> Statistics | None:
        """What the search spent; None for one that was read."""
        return None if self.search is None else self.search.statistics

    @cached_property
    def records(self) -> tuple[VerifyResult, ...]:
        """ζ of each target in percent, under all models of occlusion, as ``save`` writes it."""
        from .reporting.comparison import counted

        goals = [goal.target for goal in self.scene.core.goals]
        known = {(self.name, v.target): v for v in self.each}
        return tuple(counted(self._verifier, {self.name: self.setup}, goals, goals, known))

    def compare(self, progress: Callable[[int, int], None] | None = None) -> list[VerifyResult]:
        """ζ of the proposal and of the paper's layouts for all targets, by the same verifier.

        Ctrl-C ends the comparison; what is counted until then is returned.

        Args:
            progress: is given the number of poses counted, from 0, and of all.
        """
        from .reporting.comparison import compared, counted, papers

        core, verifier = self.scene.core, copy(self._verifier)
        goals, targets = [goal.target for goal in core.goals], compared(core)
        setups = {self.name: self.setup} | papers(core)
        counts = () if self.search is None else self.search.verified
        known = {(self.name, v.target): v for v in counts}
        found: list[VerifyResult] = []
        done, total = 0, len(targets) * len(setups) * len(core.poses)

        def tell(poses: int) -> None:
            nonlocal done
            done = poses
            if progress is not None:
                progress(done, total)

        verifier.at = lambda _: tell(min(done + 1, total))
        try:
            tell(0)
            for one in counted(verifier, setups, targets, goals, known):
                found.append(one)
                tell(len(found) * len(core.poses))
        except KeyboardInterrupt:
            pass
        return found

    def compare_criterion(self) -> dict[str, float]:
        """What the search made large, in percent, of the proposal and of the paper's layouts; empty
        where that is ζ itself.
        """
        from .reporting.comparison import papers

        if self.criterion.plain or self.search is None:
            return {}
        core, found = self.scene.core, {self.name: 100 * self.search.exact}
        verifier = Verifier(core, self._verifier.voxel)
        try:
            for name, one in papers(core).items():
                found[name] = 100 * judge(verifier, one, self.criterion)[1]
        except KeyboardInterrupt:
            pass
        return found

    def file(self, records: Sequence[VerifyResult] | None = None) -> ProposalFile:
        """The model of the proposal's file; ``records`` where they are counted already."""
        core, zeta = self.scene.core, list(self.records if records is None else records)
        if len(core.poses) > MANY:
            zeta = [r.model_copy(update={"poses": []}) for r in zeta]
        return ProposalFile.of(
            self.setup,
            core,
            zeta=[r.model_copy(update={"setup": "proposal"}) for r in zeta],
            found=self.found or self._found(),
        )

    def search_file(
        self,
        comparison: list[VerifyResult],
        criterion_percent: dict[str, float],
        files: dict[str, str],
    ) -> SearchFile:
        """The model of ``result.json``: the proposal beside the paper's layouts.

        Raises:
            ValueError: for a proposal that was read.
        """
        if self.search is None:
            raise ValueError("found a proposal that was read, allowed: one from search")
        soft = self.search.soft
        own = self.own_records(comparison)
        return SearchFile(
            proposal=self.file(own),
            soft_minus_exact_percent=(None if soft is None else 100 * (soft - self.search.exact)),
            comparison=comparison,
            asked_percent=criterion_percent,
            files=files,
            reach=self.reach_record(),
            short_percent=100 * self.search.short,
            sensors=sensor_records(self.setup),
        )

    def own_records(self, comparison: Sequence[VerifyResult]) -> list[VerifyResult]:
        """Those of a comparison that are of the proposal and of a target of its scene."""
        goals = {(g.target.name, g.target.radius) for g in self.scene.core.goals}
        return [r for r in comparison if r.setup == self.name and (r.target, r.radius) in goals]

    def reach_record(self) -> ReachModel | None:
        """The searches for the fewest sensors, in percent; None where none were asked for."""
        if self.reach is None or self.wanted_percent is None:
            return None
        tried = [
            ReachedModel(sensors=n, exact_percent=100 * value, reached=reached)
            for n, (value, reached) in self.reach.tried.items()
        ]
        return ReachModel(
            wanted_percent=self.wanted_percent, reached=self.reach.reached, tried=tried
        )

    def save(self, path: str | Path) -> Path:
        """Write the proposal as TOML, at once: a kill leaves the old file or the new one.

        Raises:
            InputError: if the file cannot be written.
        """
        with input_errors():
            write_proposal(Path(path), self.file())
        return Path(path)

    def captions(self) -> list[str]:
        return [f"{v.target}: {100 * v.zeta:.1f} % covered" for v in self.each]

    def rows(self) -> Iterable[Sequence[str]]:
        for v in self.each:
            yield str(v.target), f"{100 * v.zeta:.2f} %"
        if len(self.each) > 1:
            yield "weighted mean", f"{100 * self.coverage:.2f} %"
        if not self.criterion.plain and self.value is not None:
            yield str(self.criterion), f"{100 * self.value:.2f} %"
        if self.outcome is not None:
            yield "search", self.outcome.value

    @cached_property
    def _verifier(self) -> Verifier:
        return Verifier(self.scene.core) if self.verifier is None else self.verifier

    def _found(self) -> FoundModel | None:
        if self.search is None:
            return None
        return found_model(self.search, self.seed, self.criterion, self.command)


def found_model(result: SearchResult, seed: int, criterion: Criterion, command: str) -> FoundModel:
    """How a search found its setup, with these versions."""
    spent = result.statistics
    return FoundModel(
        outcome=result.outcome.value,
        seed=seed,
        soft_percent=None if result.soft is None else 100 * result.soft,
        exact_percent=100 * result.exact,
        width=spent.width,
        starts=spent.starts,
        evaluations=spent.evaluations,
        seconds=round(spent.seconds, 1),
        start_up_seconds=round(spent.start_up, 1),
        count_seconds=round(spent.counting, 1),
        command=command,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        versions=versions(),
        redundancy=criterion.seen,
        losing=criterion.losing,
        tolerant=ErrorsModel.of(criterion),
    )


def write_proposal(path: Path, file: ProposalFile) -> None:
    """Write a proposal's file under its heading; UserError if it cannot be written."""
    write_text(path, to_toml(file, _HEADING))
