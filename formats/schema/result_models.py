"""Models of the output of ``verify --json``: counts and guaranteed intervals, in percent."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Self

import numpy as np
from jaxtyping import Float
from pydantic import ConfigDict, Field

from ...coverage.choices import Rule
from ...coverage.definitions.units import degrees
from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.rings.ring import Setup
from ...coverage.robots.joint_values import named
from ...coverage.robots.kinematics import Chain
from ...objectives.calibration_effect import CalibrationEffect
from ...objectives.feasibility.mounting import Fault
from ...objectives.occlusion import Unseeing
from ...objectives.reach import Beyond
from ...objectives.scene import CoreScene
from ...objectives.verified import PoseZeta, Verified
from ...objectives.verify_breakdown import PeopleShare
from .base_model import StrictModel
from .field_types import Metres, Percent
from .mapping import COVERAGE, MappedModel, Of, rounded_millimetres
from .sensor_records import SensorRecord
from .separation_models import SeparationModel

ErrorPoints = Annotated[Percent | None, Of("error", COVERAGE)]
"""Error of a coverage, percentage points."""
_ERROR = Field(
    default=None,
    description=(
        "computed error of the coverage, percentage points: 3.3 standard deviations (99.9 %), or"
        " half of a guaranteed interval; none for the rules centre and touch"
    ),
)


class ProofModel(StrictModel):
    """How a certified interval was computed; over several poses, the largest or total effort."""

    width_percent: Percent = Field(
        description="requested width, percentage points; 0: none, cells of one size"
    )
    reached: bool = Field(description="whether the requested width was reached at every pose")
    passes: int = Field(description="largest number of passes")
    cells: int = Field(description="total number of cells in the last passes")
    smallest: Metres = Field(description="side of the smallest cell, m")

    @classmethod
    def of(cls, verified: Verified) -> Self | None:
        """Return the record of a certified interval over all poses; None for another rule."""
        proofs = [p.proof for p in verified.poses if p.proof is not None]
        if not proofs:
            return None
        return cls(
            width_percent=100 * verified.width,
            reached=all(p.reached for p in proofs),
            passes=max(p.passes for p in proofs),
            cells=sum(p.cells for p in proofs),
            smallest=min(p.smallest for p in proofs),
        )


def _without_ends(schema: dict[str, Any]) -> None:
    """Let files omit the ends of an interval that is ζ itself, as proposals do."""
    ends = ("low_percent", "high_percent")
    schema["required"] = [key for key in schema["required"] if key not in ends]


_ENDS_OMITTED = ConfigDict(json_schema_extra=_without_ends)


class PoseZetaModel(MappedModel[PoseZeta]):
    """Coverage at one pose."""

    model_config = _ENDS_OMITTED

    weight: float = Field(description="weight of the pose")
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)] = Field(description="coverage, percent")
    low_percent: Annotated[Percent, Of("low", COVERAGE)] = Field(
        description="lower end of the guaranteed interval, percent; without one, zeta itself"
    )
    high_percent: Annotated[Percent, Of("high", COVERAGE)] = Field(
        description="upper end of the guaranteed interval, percent; without one, zeta itself"
    )
    error_points: ErrorPoints = _ERROR
    target_voxels: int | None = Field(default=None, description="voxels in the target")
    covered_voxels: int | None = Field(default=None, description="covered voxels in the target")


def joint_keys_of(chain: Chain, q: Float[np.ndarray, " J"]) -> dict[str, Any]:
    """Return the keys for joint values in rad and m: ``q_deg``, or ``q`` if a joint is
    prismatic."""
    if chain.prismatic:
        return {"q": named(chain, q)}
    return {"q_deg": [degrees(angle) for angle in q]}


class WorstModel(MappedModel[PoseZeta]):
    """The pose with the lowest coverage."""

    model_config = _ENDS_OMITTED

    pose: int = Field(ge=0, description="number of the pose, counted from 0")
    time_s: float | None = Field(default=None, description="time in the recorded motion, s")
    q_deg: list[float] | None = Field(default=None, description="joint angles, degrees")
    q: dict[str, float] | None = Field(
        default=None,
        description="joint values by name and unit, in place of q_deg if a joint is prismatic",
    )
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)] = Field(description="coverage, percent")
    low_percent: Annotated[Percent, Of("low", COVERAGE)] = Field(
        description="lower end of the guaranteed interval, percent; without one, zeta itself"
    )
    high_percent: Annotated[Percent, Of("high", COVERAGE)] = Field(
        description="upper end of the guaranteed interval, percent; without one, zeta itself"
    )
    error_points: ErrorPoints = _ERROR


class UnseeingModel(MappedModel[Unseeing]):
    """A blocked sensor: it sees less than 1 % of its cone, or nothing because it sits inside a
    body."""

    ring: int = Field(
        description="number of the ring, counted from 0; single sensors follow the rings"
    )
    sensor: int = Field(description="number of the sensor on its ring, counted from 0")
    poses: int = Field(description="number of poses at which it is blocked")
    within: str | None = Field(
        default=None, description="name of the body or obstacle that contains it"
    )
    depth_mm: Annotated[float, Of("depth", rounded_millimetres(3))] = Field(
        default=0.0, description="largest depth inside it, mm"
    )
    single: str = Field(
        default="",
        description="name of a single sensor or of one of the cell; empty for a sensor of a ring",
    )

    @classmethod
    def from_domain(cls, value: Unseeing, **given: Any) -> Self:
        """Return the record of a blocked sensor."""
        return super().from_domain(value, poses=len(value.poses), **given)


_LOW = Field(
    description="lower end of the guaranteed interval, percent; by another rule, zeta itself"
)
_HIGH = Field(
    description="upper end of the guaranteed interval, percent; by another rule, zeta itself"
)


class LiftedModel(StrictModel):
    """A single sensor that was lifted out of the body of its own link."""

    ring: int = Field(description="its number among those of rings and single sensors, from 0")
    name: str = Field(description="name of the sensor; may be empty")
    lifted_mm: float = Field(description="distance along its axis, mm")

    @classmethod
    def each(cls, setup: Setup) -> list[Self]:
        """Return the records of a setup's lifted sensors."""
        return [
            cls(ring=n, name=one.name, lifted_mm=round(1000 * one.lifted, 3))
            for n, one in enumerate(setup.singles, len(setup.rings))
            if one.lifted > 0
        ]


class CalibrationEffectModel(StrictModel):
    """What the calibration of the arm changes."""

    source: str = Field(description="file or controller that stated the calibration")
    largest_move_mm: float = Field(description="largest move of a sensor at a pose, mm")
    nominal_percent: Percent = Field(description="coverage with the model's kinematics, percent")

    @classmethod
    def each(cls, effect: CalibrationEffect | None) -> list[Self]:
        """Return the records of an effect, one for each goal; none without a calibration."""
        if effect is None:
            return []
        move = round(1000 * effect.largest_move, 3)
        return [
            cls(
                source=effect.source,
                largest_move_mm=move,
                nominal_percent=COVERAGE.write(one.zeta),
            )
            for one in effect.nominal
        ]


class VerifyResult(MappedModel[Verified]):
    """Output of ``verify --json`` for each target. A proposal with many poses omits ``poses``."""

    model_config = _ENDS_OMITTED

    setup: str = Field(description="name or file of the setup")
    target: str = Field(description="name of the target")
    radius: float | None = Field(default=None, description="radius of V_S or V_N, m")
    rule: Rule = Field(description="rule of the count")
    voxel: Metres | None = Field(
        default=None,
        description="side of a voxel, m; certified: of the smallest requested cell",
    )
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)] = Field(
        description="coverage, percent, as a mean over the poses"
    )
    low_percent: Annotated[Percent, Of("low", COVERAGE)] = _LOW
    high_percent: Annotated[Percent, Of("high", COVERAGE)] = _HIGH
    error_points: ErrorPoints = _ERROR
    target_voxels: int | None = Field(
        default=None, description="voxels in the target at all poses; none if certified"
    )
    covered_voxels: int | None = Field(
        default=None, description="covered voxels in the target at all poses"
    )
    proof: ProofModel | None = Field(default=None, description="effort of a certified interval")
    worst: WorstModel | None = Field(
        default=None, description="pose with the lowest coverage, of several"
    )
    occlusion: Occlusion = Field(default="ignore", description="occlusion model of the count")
    mounting: list[str] = Field(
        default=[], description="reasons why real rings could not be mounted"
    )
    unmounted: list[int] = Field(
        default=[], description="rings that could not be mounted, by their numbers"
    )
    by_occlusion_percent: dict[Occlusion, Percent] = Field(
        default={}, description="coverage under each occlusion model, percent"
    )
    by_occlusion_error_points: dict[Occlusion, Percent] = Field(
        default={}, description="errors of these, percentage points, as error_points"
    )
    dark_clothing_percent: Percent | None = Field(
        default=None,
        description=(
            "coverage with the sensors' range on dark clothing (17 %) at their light, percent; none"
            " without figures of a sensor, and for an interval"
        ),
    )
    by_part_percent: dict[str, Percent] = Field(
        default={},
        description=(
            "coverage by the rings, the single sensors and the sensors of the cell alone, percent,"
            " where there are several of these"
        ),
    )
    unseeing: list[UnseeingModel] = Field(
        default=[],
        description="blocked sensors; not sought for the layouts beside a proposal",
    )
    lifted: list[LiftedModel] = Field(
        default=[], description="single sensors that were lifted out of the body in which they lay"
    )
    calibration: CalibrationEffectModel | None = Field(
        default=None, description="what the calibration of the arm changes, if it has one"
    )
    beyond: Beyond | None = Field(
        default=None, description="part of the target that no layout covers"
    )
    people: PeopleShare | None = Field(
        default=None, description="part of the target that the scene's person can touch"
    )
    poses: list[PoseZetaModel] = Field(default=[], description="coverage at each pose")
    sensors: list[SensorRecord] = Field(default=[], description="catalogue sensors of the setup")
    separation: SeparationModel | None = Field(
        default=None, description="separation distances of V_P"
    )
    seconds: float = Field(ge=0, description="duration of the count, s")

    @classmethod
    def of(cls, name: str, verified: Verified, scene: CoreScene | None = None) -> Self:
        """Return the record of a verified ζ of the setup ``name``.

        With a ``scene``, the record includes its occlusion model, the worst pose and the separation
        distances of V_P.
        """
        poses, target = () if scene is None else scene.poses, verified.target
        name_of, radius = target.key
        worst = verified.worst
        return cls.from_domain(
            verified,
            setup=name,
            target=name_of,
            radius=radius,
            proof=ProofModel.of(verified),
            occlusion="ignore" if scene is None else scene.occlusion,
            separation=None if scene is None else SeparationModel.of(scene, target),
            worst=None
            if scene is None or len(poses) < 2
            else WorstModel.from_domain(
                verified.poses[worst],
                pose=worst,
                time_s=poses[worst].time_s,
                **joint_keys_of(scene.robot.chain, poses[worst].q),
            ),
        )

    def with_dark(self, dark: Verified | None) -> Self:
        """Return the record with ζ for dark clothing, if it is known."""
        percent = None if dark is None else COVERAGE.write(dark.zeta)
        return self.model_copy(update={"dark_clothing_percent": percent})

    def with_parts(self, zetas: dict[str, float]) -> Self:
        """Return the record with ζ in [0, 1] of each part of a mixed system alone."""
        percent = {part: COVERAGE.write(zeta) for part, zeta in zetas.items()}
        return self.model_copy(update={"by_part_percent": percent})

    def with_mounting(self, faults: Iterable[Fault]) -> Self:
        """Return the record with the faults of the mount."""
        each = list(faults)
        rings = sorted({ring for fault in each for ring in fault.rings})
        return self.model_copy(
            update={"mounting": [fault.text for fault in each], "unmounted": rings}
        )

    def with_occlusion(
        self,
        counts: Mapping[Occlusion, Verified],
        blocked: Iterable[Unseeing] = (),
        faults: Iterable[Fault] = (),
    ) -> Self:
        """Return the record with the counts under each model, the blocked sensors, and the faults
        of the mount."""
        return self.with_mounting(faults).model_copy(
            update={
                "by_occlusion_percent": {m: COVERAGE.write(v.zeta) for m, v in counts.items()},
                "by_occlusion_error_points": {
                    m: COVERAGE.write(v.error) for m, v in counts.items() if v.error is not None
                },
                "unseeing": [UnseeingModel.from_domain(one) for one in blocked],
            }
        )
