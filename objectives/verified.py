"""Records of zeta, counted or certified: of one target at one pose, and over all poses."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, Self

from pydantic import Field, PlainSerializer, PlainValidator

from ..coverage.choices import Rule
from ..coverage.definitions.definition import definition, fault
from ..coverage.definitions.field_types import InPython, Items, Metres
from ..coverage.definitions.records import JsonRecord
from ..coverage.definitions.units import Covered, Millimetres
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.sensor_records import SensorRecord
from ..coverage.robots.joint_values import joint_keys_of
from ..coverage.targets.target import Target
from ..coverage.voxels.volume_tally import Bracket
from .detected import Detected
from .feasibility.mounting import Fault
from .object_bounds import SmallestObject
from .occlusion import Unseeing
from .reach import Beyond
from .scene import Scene
from .separation_summary import Separations, separations


def weighted_mean(weights: Iterable[float], shares: Iterable[float]) -> float:
    """Return the weighted mean of shares in [0, 1], capped at 1.

    The weights sum to 1 up to rounding, which could otherwise raise the mean above 1.
    """
    return min(
        math.fsum(float(w) * float(share) for w, share in zip(weights, shares, strict=True)), 1.0
    )


Zeta = Annotated[float, Covered("zeta_percent")]
Low = Annotated[float, Covered("low_percent")]
High = Annotated[float, Covered("high_percent")]
Error = Annotated[float, Covered("error_points")]


class WithInterval:
    """Zeta with an interval, which is zeta itself where none is stated."""

    zeta: float
    low: float
    high: float

    def __post_init__(self) -> None:
        for end in ("low", "high"):
            if getattr(self, end) is None:
                vars(self)[end] = self.zeta


@definition
class PoseZeta(WithInterval):
    """Coverage at one pose."""

    weight: float
    """Weight of the pose."""
    zeta: Zeta
    """Coverage; the middle of an interval."""
    low: Low = None  # type: ignore[assignment]
    """Lower end of the guaranteed interval; without one, zeta itself."""
    high: High = None  # type: ignore[assignment]
    """Upper end of the guaranteed interval; without one, zeta itself."""
    error: Error | None = None
    """Computed error of the coverage: 3.3 standard deviations (99.9 %), or half of a guaranteed
    interval; none for the rules centre and touch."""
    target_voxels: int | None = None
    """Voxels in the target; none if certified."""
    covered_voxels: int | None = None
    """Covered voxels in the target; none if certified."""
    bounds: InPython[Bracket | None] = None
    """How the ends of a guaranteed interval were computed; not in files."""


@definition(kw_only=True)
class LowestPose(WithInterval):
    """The pose with the lowest coverage."""

    pose: Annotated[int, Field(ge=0)]
    """Number of the pose, counted from 0."""
    time_s: float | None = None
    """Time in the recorded motion, s."""
    q_deg: list[float] | None = None
    """Joint angles, degrees."""
    q: dict[str, float] | None = None
    """Joint values by name and unit, in place of q_deg if a joint is prismatic."""
    zeta: Zeta
    """Coverage."""
    low: Low = None  # type: ignore[assignment]
    """Lower end of the guaranteed interval; without one, zeta itself."""
    high: High = None  # type: ignore[assignment]
    """Upper end of the guaranteed interval; without one, zeta itself."""
    error: Error | None = None
    """Computed error of the coverage, as for each pose."""


@definition
class IntervalProof:
    """How a certified interval was computed; over several poses, the largest or total effort."""

    width: Annotated[float, Covered("width_percent")]
    """Requested width; 0: none, cells of one size."""
    reached: bool
    """Whether the requested width was reached at every pose."""
    passes: int
    """Largest number of passes."""
    cells: int
    """Total number of cells in the last passes."""
    smallest: Metres
    """Side of the smallest cell, m."""


def proof_of(width: float, bounds: Sequence[Bracket]) -> IntervalProof | None:
    """Return the effort of intervals of a requested width at all poses; None without any."""
    if not bounds:
        return None
    return IntervalProof(
        width,
        all(b.reached for b in bounds),
        max(b.passes for b in bounds),
        sum(b.cells for b in bounds),
        min(b.smallest for b in bounds),
    )


@definition
class PeopleShare:
    """The part of a target that a person can touch."""

    share: Annotated[float, Covered("percent")]
    """Part of the target's volume that a person can touch, a mean over the poses."""
    zeta: Zeta
    """Coverage of this part, a mean over the poses at which there is such a part."""


@definition
class CalibrationEffect:
    """What the calibration of the arm changes."""

    source: str
    """File or controller that stated the calibration."""
    largest_move: Annotated[float, Millimetres("largest_move_mm", digits=3)]
    """Largest move of a sensor at a pose of the scene, m."""
    nominal: Annotated[float, Covered("nominal_percent")]
    """Coverage with the model's kinematics."""


@definition
class Lifted:
    """A single sensor that was lifted out of the body of its own link."""

    ring: int
    """Its number among those of rings and single sensors, from 0."""
    name: str
    """Name of the sensor; may be empty."""
    lifted: Annotated[float, Millimetres("lifted_mm", digits=3)]
    """Distance along its axis, m."""


def lifted(setup: Setup) -> list[Lifted]:
    """Return the records of a setup's lifted sensors."""
    singles = enumerate(setup.singles, len(setup.rings))
    return [Lifted(n, single.name, single.lifted) for n, single in singles if single.lifted > 0]


def _target_or_name(value: Any) -> Any:
    if isinstance(value, Target | str):
        return value
    raise fault(value, "name of a target")


TargetName = Annotated[
    Target,
    PlainValidator(_target_or_name, json_schema_input_type=str),
    PlainSerializer(lambda t: t if isinstance(t, str) else t.key[0], return_type=str),
]
"""A target; its name in files, from which it is not read back."""


class OfTarget:
    """A record of a target: ``radius`` is its own."""

    target: Any
    radius: float | None

    def __post_init__(self) -> None:
        if isinstance(self.target, Target):
            vars(self)["radius"] = self.target.key[1]

    @property
    def key(self) -> tuple[str, float | None]:
        """Name and radius of the target, as ``Target.key``."""
        return self.target.key if isinstance(self.target, Target) else (self.target, self.radius)


@definition(kw_only=True)
class Verified(WithInterval, OfTarget, JsonRecord):
    """Coverage of a target by a setup, counted or certified, over all poses. A proposal with many
    poses omits ``poses``."""

    setup: str = ""
    """Name or file of the setup."""
    target: TargetName
    """The target volume; from a file, its name."""
    radius: float | None = None
    """Radius of V_S or V_N, m."""
    rule: Rule
    """Rule of the count."""
    voxel: Metres | None = None
    """Side of a voxel, m; certified: of the smallest requested cell."""
    zeta: Zeta
    """Coverage as a mean over the poses."""
    low: Low = None  # type: ignore[assignment]
    """Lower end of the guaranteed interval; by another rule, zeta itself."""
    high: High = None  # type: ignore[assignment]
    """Upper end of the guaranteed interval; by another rule, zeta itself."""
    error: Error | None = None
    """Computed error of the coverage: the mean of the poses' errors, as these are not
    independent."""
    target_voxels: int | None = None
    """Voxels in the target at all poses; none if certified."""
    covered_voxels: int | None = None
    """Covered voxels in the target at all poses."""
    proof: IntervalProof | None = None
    """Effort of a certified interval."""
    worst: LowestPose | None = None
    """Pose with the lowest coverage, of several."""
    occlusion: Occlusion = "ignore"
    """Occlusion model of the count."""
    mounting: Items[str] = ()
    """Reasons why real rings could not be mounted."""
    unmounted: Items[int] = ()
    """Rings that could not be mounted, by their numbers."""
    by_occlusion: dict[Occlusion, Annotated[float, Covered("by_occlusion_percent")]] = field(
        default_factory=dict
    )
    """Coverage under each occlusion model."""
    by_occlusion_error: dict[Occlusion, Annotated[float, Covered("by_occlusion_error_points")]] = (
        field(default_factory=dict)
    )
    """Errors of these, as of the coverage."""
    dark_clothing: Annotated[float, Covered("dark_clothing_percent")] | None = None
    """Coverage with the sensors' range on dark clothing (17 %) at their light; none without figures
    of a sensor, and for an interval."""
    detection: Detected | None = None
    """Expected share in which a test piece is detected, if it was asked for."""
    by_part: dict[str, Annotated[float, Covered("by_part_percent")]] = field(default_factory=dict)
    """Coverage by the rings, the single sensors and the sensors of the cell alone, where there are
    several of these."""
    unseeing: Items[Unseeing] = ()
    """Blocked sensors; not sought for the layouts beside a proposal."""
    lifted: Items[Lifted] = ()
    """Single sensors that were lifted out of the body in which they lay."""
    calibration: CalibrationEffect | None = None
    """What the calibration of the arm changes, if it has one."""
    beyond: Beyond | None = None
    """Part of the target that no layout covers."""
    people: PeopleShare | None = None
    """Part of the target that the scene's person can touch."""
    poses: Items[PoseZeta] = ()
    """Coverage at each pose."""
    sensors: Items[SensorRecord] = ()
    """Catalogue sensors of the setup."""
    separation: Separations | None = None
    """Separation distances of V_P."""
    smallest_object: SmallestObject | None = None
    """Largest unseen objects; none unless they were asked for or the target limits them."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration of the count, s."""

    def __post_init__(self) -> None:
        WithInterval.__post_init__(self)
        OfTarget.__post_init__(self)

    def in_scene(self, name: str, scene: Scene) -> Self:
        """Return the record with the name of its setup and, of its scene, the occlusion model, the
        worst pose (the first of equals) and the separation distances of V_P."""
        worst = None
        if len(scene.poses) > 1:
            at = min(range(len(self.poses)), key=lambda i: self.poses[i].zeta)
            worst = LowestPose(
                pose=at,
                time_s=scene.poses[at].time_s,
                **joint_keys_of(scene.robot.chain, scene.poses[at].q),
                **{key: getattr(self.poses[at], key) for key in ("zeta", "low", "high", "error")},
            )
        distances = separations(scene, self.target)
        return replace(
            self, setup=name, occlusion=scene.occlusion, worst=worst, separation=distances
        )

    def with_mounting(self, faults: Iterable[Fault]) -> Self:
        """Return the record with the faults of the mount."""
        each = list(faults)
        rings = sorted({ring for fault in each for ring in fault.rings})
        return replace(self, mounting=tuple(f.text for f in each), unmounted=tuple(rings))
