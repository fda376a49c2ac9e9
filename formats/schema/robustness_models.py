"""Models of mounting errors, and of the output of ``robustness --json``."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from ...coverage.definitions.field_types import Metres
from ...coverage.definitions.units import degrees
from ...coverage.rings.mounting_errors import MountingErrors
from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion
from ...objectives.redundancy import Loss, Redundancy
from ...objectives.tolerance import Tolerance
from .base_model import StrictModel
from .field_types import Percent
from .mapping import COVERAGE, DEGREES, MappedModel, Of, rounded_millimetres


class ErrorsModel(MappedModel[MountingErrors]):
    """Mounting errors: limits (uniform) or twice the standard deviations (normal)."""

    position_mm: Annotated[float, Of("position", rounded_millimetres(9))] = Field(
        default=1000 * MountingErrors.position,
        ge=0,
        le=1000,
        description="error of each ring's position along its link, mm",
    )
    direction_deg: Annotated[float, Of("direction", DEGREES)] = Field(
        default=degrees(MountingErrors.direction),
        ge=0,
        le=45,
        description="error of each ring's and each sensor's direction, degrees",
    )
    law: Literal["uniform", "normal"] = Field(
        default="uniform", description="distribution of the errors"
    )
    draws: int = Field(default=100, ge=1, le=100_000, description="number of random mountings")
    seed: int = Field(default=0, ge=0, description="random seed of the mountings")

    @classmethod
    def of(cls, criterion: Criterion) -> Self | None:
        """Return the mounting errors of a criterion, if any."""
        if criterion.errors is None:
            return None
        return cls.from_domain(criterion.errors, draws=criterion.draws, seed=criterion.seed)


class LossModel(StrictModel):
    """Loss of a ring or sensor, and the coverage without it."""

    ring: int = Field(
        description="number of the ring, counted from 0; single sensors follow the rings"
    )
    link: str = Field(description="link of the ring or single sensor")
    sensor: int | None = Field(
        default=None, description="number of the sensor on its ring, counted from 0"
    )
    single: str = Field(
        default="", description="name of a single sensor; empty for a ring and its sensors"
    )
    zeta_percent: Percent = Field(description="coverage without it, percent")


class RobustnessResult(StrictModel):
    """Output of ``robustness --json`` for each target. All values are counts by the rule
    ``sampled``, apart from the Monte Carlo error of the draws."""

    setup: str = Field(description="name or file of the setup")
    target: str = Field(description="name of the target")
    radius: float | None = Field(default=None, description="radius of V_S or V_N, m")
    voxel: Metres = Field(description="side of the voxels, m")
    zeta_percent: Percent = Field(description="coverage, percent")
    seen_percent: list[Percent] = Field(
        description="shares that at least 1, 2, ... sensors see, percent"
    )
    worst_sensor: LossModel = Field(description="sensor whose loss costs most")
    worst_ring: LossModel = Field(description="ring whose loss costs most")
    without_sensor_percent: list[Percent] = Field(
        description="coverage without each sensor, percent"
    )
    without_ring_percent: list[Percent] = Field(description="coverage without each ring, percent")
    errors: ErrorsModel = Field(description="mounting errors")
    mean_percent: Percent = Field(description="mean coverage under mounting errors, percent")
    mean_error_percent: float | None = Field(
        default=None,
        ge=0,
        description="standard error of the mean, percentage points; none for a single draw",
    )
    fifth_percentile_percent: Percent = Field(description="5th percentile of the coverage, percent")
    worst_percent: Percent = Field(description="lowest coverage of all draws, percent")
    drawn_percent: list[Percent] = Field(description="coverage of each draw, percent")
    seconds: float = Field(ge=0, description="duration of the counts, s")

    @property
    def key(self) -> tuple[str, float | None]:
        """Name and radius of the target, as ``Target.key``."""
        return self.target, self.radius

    @classmethod
    def of(cls, name: str, setup: Setup, sure: Redundancy, astray: Tolerance) -> Self:
        """Return the record of redundancy and tolerance of the setup ``name``."""
        ring_of, first = (
            setup.ring_of_sensor,
            np.cumsum([0, *(group.count for group in setup.groups)]),
        )

        def loss(ring: int, lost: Loss, sensor: int | None = None) -> LossModel:
            return LossModel(
                ring=ring,
                link=setup.groups[ring].link,
                sensor=sensor,
                single=setup.group_name(ring) if ring >= len(setup.rings) else "",
                zeta_percent=COVERAGE.write(lost.zeta),
            )

        sensor, ring = sure.worst_sensor, sure.worst_ring
        at = int(ring_of[sensor.index])
        return cls(
            setup=name,
            target=sure.target.key[0],
            radius=sure.target.key[1],
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
