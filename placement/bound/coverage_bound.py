"""What an upper bound on the coverage of every layout states. It loads no SciPy, as records do."""

from typing import Annotated

from pydantic import Field

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Items
from ...coverage.definitions.units import Covered, Decimals, Points

NOTHING = 0.9995
"""A bound of at least this says nothing."""


@definition
class TermBound:
    """Upper bound of the coverage of one target at one pose."""

    target: str
    """Label of the target."""
    pose: Annotated[int, Field(ge=0)]
    """Number of the pose, counted from 0."""
    value: Annotated[float, Covered("bound_percent")]
    """The lower of the two bounds."""
    by_volume: Annotated[float, Covered("by_volume_percent")]
    """Bound by the volume of the beams alone."""
    by_prices: Annotated[float, Covered("by_prices_percent")]
    """Bound by prices of places; 1 where none beat the volume."""


@definition
class CoverageBound:
    """Upper bound on what any layout of the same budget could cover, and the gap to it."""

    value: Annotated[float, Covered("bound_percent")] | None = None
    """No layout within the budget and the rules reaches more of the criterion; none after
    Ctrl-C."""
    gap: Annotated[float, Points("gap_points", 16)] | None = None
    """The bound less the proposal's value of the criterion."""
    informative: bool = False
    """Whether the bound is below 100 %."""
    fewest_sensors: int | None = None
    """For a search for the fewest sensors: no layout of fewer reaches the coverage; none where that
    says nothing."""
    terms: Items[TermBound] = ()
    """Bounds of each target at each pose, of at most 64."""
    seconds: Annotated[float, Decimals(1, ge=0)] = 0.0
    """Time that the bound took, s."""
