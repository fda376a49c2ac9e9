"""Records of zeta of detection: of one target at one pose, and over all poses."""

from typing import Annotated

from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import Items, Metres
from ..coverage.definitions.units import Covered
from ..coverage.detection.detection import Detection


@definition(kw_only=True)
class PoseDetected:
    """Zeta of detection at one pose."""

    weight: float
    """Weight of the pose."""
    zeta: Annotated[float, Covered("zeta_percent")]
    """Expected share in which the piece is detected; the middle of a guaranteed interval."""
    low: Annotated[float, Covered("low_percent")] | None = None
    """Lower end of the guaranteed interval, if it was computed."""
    high: Annotated[float, Covered("high_percent")] | None = None
    """Upper end of the guaranteed interval, if it was computed."""
    error: Annotated[float, Covered("error_points")] | None = None
    """Computed error of the count: 3.3 standard deviations (99.9 %); none for the rule centre, and
    beside a guaranteed interval."""
    assumed_low: Annotated[float, Covered("assumed_low_percent")] | None = None
    """Zeta with the least favourable of the law's assumptions; not beside a guaranteed interval."""
    assumed_high: Annotated[float, Covered("assumed_high_percent")] | None = None
    """Zeta with the most favourable of the law's assumptions; not beside a guaranteed interval."""


@definition(kw_only=True)
class Detected:
    """Zeta of detection of a target: the expected share of it in which a test piece is detected in
    time, as a mean over the poses. Three things are kept apart: the error of the count, the
    interval that is guaranteed to hold the law's value, and what the law's assumptions leave open.
    """

    question: Detection
    """What is to be detected, in which light, in which time and by how many sensors."""
    zeta: Annotated[float, Covered("zeta_percent")]
    """Expected share; the middle of a guaranteed interval."""
    low: Annotated[float, Covered("low_percent")] | None = None
    """Lower end of the guaranteed interval, if it was computed."""
    high: Annotated[float, Covered("high_percent")] | None = None
    """Upper end of the guaranteed interval, if it was computed."""
    error: Annotated[float, Covered("error_points")] | None = None
    """Computed error of the count: the mean of the poses' errors, as these are not independent."""
    assumed_low: Annotated[float, Covered("assumed_low_percent")] | None = None
    """Zeta with the least favourable of the law's assumptions."""
    assumed_high: Annotated[float, Covered("assumed_high_percent")] | None = None
    """Zeta with the most favourable of the law's assumptions."""
    law_error: Annotated[float, Covered("law_error_points")] = 0.0
    """Error of the law itself: it held 95 % of the questions of a study against rays in MuJoCo."""
    cell: Metres | None = None
    """Side of the cells of a guaranteed interval, m."""
    poses: Items[PoseDetected] = ()
    """Zeta of detection at each pose."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration of the computation, s."""
