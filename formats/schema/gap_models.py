"""Models of the upper bound on every layout of the same budget."""

from typing import Self

from pydantic import Field

from ...objectives.scene import Scene
from ...placement.bound.coverage_bound import CoverageBound
from .base_model import StrictModel
from .field_types import Percent


class TermBoundModel(StrictModel):
    """Upper bound of the coverage of one target at one pose."""

    target: str = Field(description="label of the target")
    pose: int = Field(ge=0, description="number of the pose, counted from 0")
    bound_percent: Percent = Field(description="the lower of the two bounds, percent")
    by_volume_percent: Percent = Field(
        description="bound by the volume of the beams alone, percent"
    )
    by_prices_percent: Percent = Field(
        description="bound by prices of places, percent; 100 where none beat the volume"
    )


class GapModel(StrictModel):
    """Upper bound on what any layout of the same budget could cover, and the gap to it."""

    bound_percent: Percent | None = Field(
        description="no layout within the budget and the rules reaches more, percent; null after"
        " Ctrl-C"
    )
    gap_points: float | None = Field(
        description="the bound less the proposal's value of the criterion, percentage points"
    )
    informative: bool = Field(description="whether the bound is below 100 %")
    terms: list[TermBoundModel] = Field(
        default=[], description="bounds of each target at each pose; at most 64 are listed"
    )
    seconds: float = Field(default=0.0, ge=0, description="time that the bound took, s")

    @classmethod
    def of(cls, bound: CoverageBound | None, value: float, scene: Scene) -> Self:
        """Return the record of a bound for a proposal with this ``value`` of the criterion, in
        [0, 1]."""
        if bound is None:
            return cls(bound_percent=None, gap_points=None, informative=False)
        terms = [
            TermBoundModel(
                target=str(scene.targets[t.goal].target),
                pose=t.pose,
                bound_percent=100 * t.value,
                by_volume_percent=100 * t.by_volume,
                by_prices_percent=100 * t.by_prices,
            )
            for t in bound.terms[:_LISTED]
        ]
        return cls(
            bound_percent=100 * bound.value,
            gap_points=100 * (bound.value - value),
            informative=bound.informative,
            terms=terms,
            seconds=round(bound.seconds, 1),
        )


_LISTED = 64
