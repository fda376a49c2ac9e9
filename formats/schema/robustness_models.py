"""The models of errors of mounting, and of what ``robustness --json`` prints."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from ...coverage.rings.mounting_errors import MountingErrors
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import degrees
from ...objectives.criterion import Criterion
from ...objectives.redundancy import Loss, Redundancy
from ...objectives.tolerance import Tolerance
from .base_model import StrictModel
from .field_types import Metres, Percent
from .mapping import COVERAGE, DEGREES, MappedModel, Of, rounded_millimetres


class ErrorsModel(MappedModel[MountingErrors]):
    """Errors of mounting: limits (uniform) or twice the standard deviations (normal) of each ring's
    place along its link and of each ring's and each sensor's direction; how many mountings were
    drawn, by which seed."""

    position_mm: Annotated[float, Of("position", rounded_millimetres(9))] = Field(
        default=1000 * MountingErrors.position,
        ge=0,
        le=1000,
        description="millimetres along the link",
    )
    direction_deg: Annotated[float, Of("direction", DEGREES)] = Field(
        default=degrees(MountingErrors.direction), ge=0, le=45, description="degrees"
    )
    law: Literal["uniform", "normal"] = "uniform"
    draws: int = Field(default=100, ge=1, le=100_000, description="mountings")
    seed: int = Field(default=0, ge=0)

    @classmethod
    def of(cls, criterion: Criterion) -> Self | None:
        """Return the errors that a search models, if any."""
        if criterion.errors is None:
            return None
        return cls.from_domain(criterion.errors, draws=criterion.draws, seed=criterion.seed)


class LossModel(StrictModel):
    """What a failure leaves: the ring (and the sensor of it, counted from 0), and zeta without
    it.
    """

    ring: int
    link: str
    sensor: int | None = None
    zeta_percent: Percent


class RobustnessResult(StrictModel):
    """What ``robustness --json`` prints for each target: zeta, the shares that at least 1, 2, ...
    sensors see, zeta without the sensor and without the ring that is missed most, and zeta under
    errors of mounting: mean, its standard error, 5th percentile, the least, and each draw. All are
    exact counts by the rule ``centre``, but for the luck of the draws."""

    setup: str
    target: str
    radius: float | None = None
    voxel: Metres
    zeta_percent: Percent
    seen_percent: list[Percent]
    worst_sensor: LossModel
    worst_ring: LossModel
    without_sensor_percent: list[Percent]
    without_ring_percent: list[Percent]
    errors: ErrorsModel
    mean_percent: Percent
    mean_error_percent: float | None = Field(
        default=None, ge=0, description="none for a single draw"
    )
    fifth_percentile_percent: Percent
    worst_percent: Percent
    drawn_percent: list[Percent]
    seconds: float = Field(ge=0)

    @classmethod
    def of(cls, name: str, setup: Setup, sure: Redundancy, astray: Tolerance) -> Self:
        """Return the record of redundancy and tolerance of the setup called ``name``."""
        ring_of, first = setup.ring_of_sensor, np.cumsum([0, *(r.count for r in setup.rings)])

        def loss(ring: int, found: Loss, sensor: int | None = None) -> LossModel:
            return LossModel(
                ring=ring,
                link=setup.rings[ring].link,
                sensor=sensor,
                zeta_percent=COVERAGE.write(found.zeta),
            )

        sensor, ring = sure.worst_sensor, sure.worst_ring
        at = int(ring_of[sensor.index])
        return cls(
            setup=name,
            target=sure.target.name,
            radius=sure.target.radius,
            voxel=sure.voxel,
            zeta_percent=COVERAGE.write(sure.zeta),
            seen_percent=[COVERAGE.write(z) for z in sure.zetas],
            worst_sensor=loss(at, sensor, sensor.index - int(first[at])),
            worst_ring=loss(ring.index, ring),
            without_sensor_percent=[COVERAGE.write(z) for z in sure.without_sensor],
            without_ring_percent=[COVERAGE.write(z) for z in sure.without_ring],
            errors=ErrorsModel.from_domain(
                astray.errors, draws=len(astray.zetas), seed=astray.seed
            ),
            mean_percent=COVERAGE.write(astray.mean),
            mean_error_percent=100 * astray.mean_error
            if math.isfinite(astray.mean_error)
            else None,
            fifth_percentile_percent=COVERAGE.write(astray.fifth_percentile),
            worst_percent=COVERAGE.write(astray.worst),
            drawn_percent=[COVERAGE.write(z) for z in astray.zetas],
            seconds=sure.seconds + astray.seconds,
        )
