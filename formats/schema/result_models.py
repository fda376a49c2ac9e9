"""The models of what commands print for scripts: counts, proofs, robustness."""

from typing import Literal

from pydantic import Field

from ...coverage.occlusion.model import Occlusion
from .base_model import StrictModel
from .field_types import Metres, Percent


class ProofModel(StrictModel):
    """How a certified interval was reached: the width asked for, in points (0: none, cells of one
    side), whether it was reached, passes, cells of the last pass, and the side of the smallest, m.
    Over several poses: the most, the sum, the least."""

    width_percent: Percent
    reached: bool
    passes: int
    cells: int
    smallest: Metres


class PoseZetaModel(StrictModel):
    weight: float
    zeta_percent: Percent
    low_percent: Percent
    high_percent: Percent
    target_voxels: int | None = None
    covered_voxels: int | None = None


class WorstModel(StrictModel):
    """The pose with the least zeta: which (from 0), when the record was there, and its joint
    angles.
    """

    pose: int = Field(ge=0)
    time_s: float | None = None
    q_deg: list[float]
    zeta_percent: Percent
    low_percent: Percent
    high_percent: Percent


class UnseeingModel(StrictModel):
    """A sensor that sees less than 1 % of its cone, or nothing as it stands within something: at
    how many poses, within what, and how deep at most."""

    ring: int
    sensor: int
    poses: int
    within: str | None = None
    depth_mm: float = 0.0


class RuleModel(StrictModel):
    """A rule that limits a range: what was found for it, metres left after it, and whether that was
    measured or is a law.
    """

    rule: str
    found: str
    range_m: Metres
    measured: bool


class SensorRecord(StrictModel):
    """A sensor of the catalogue: what it is used for, how its range came about rule by rule, and
    where its figures are from."""

    model: str
    title: str
    ambient: str | None = None
    reflectance: float | None = None
    target_size: list[Metres] | None = None
    fov_deg: float
    range_m: Metres
    rules: list[RuleModel]
    least_m: float | None = None
    rate_hz: float | None = None
    source: str
    note: str = ""


class SeparationModel(StrictModel):
    """The separation distances, m, of the robot's parts over a scene's poses: the least, the mean
    over the parts and, by weight, the poses, and the largest with its terms; the speed of the part
    that is fastest, m/s, and whether it follows from the joints' speeds or is the one given for
    all. No safety rating follows from them."""

    least_m: float
    mean_m: float
    largest_m: float
    fastest_m_s: float
    speeds_known: bool
    S_h: float
    S_r: float
    S_s: float
    C: float
    Z_d: float
    Z_r: float
    human_speed: float
    reaction_s: float
    stopping_s: float


_LOW = Field(description="percent, of the guaranteed interval; by another rule zeta itself")
_HIGH = Field(description="percent, likewise")


class VerifyResult(StrictModel):
    """What ``verify --json`` prints for each target: the mean over the poses, the worst of several,
    each, and the sensors of the catalogue that the setup has. A proposal of many poses leaves each
    out."""

    setup: str = Field(description="name or file")
    target: str
    radius: float | None = Field(default=None, description="metres, of V_S")
    rule: Literal["centre", "touch", "certified"]
    voxel: Metres | None = Field(
        default=None,
        description="metres, side of a voxel; certified: of the smallest cell asked for",
    )
    zeta_percent: Percent = Field(description="percent, mean over the poses")
    low_percent: Percent = _LOW
    high_percent: Percent = _HIGH
    target_voxels: int | None = Field(default=None, description="of all poses; none when certified")
    covered_voxels: int | None = Field(default=None, description="of these, seen")
    proof: ProofModel | None = Field(default=None, description="when certified")
    worst: WorstModel | None = Field(default=None, description="of several poses")
    occlusion: Occlusion = Field(
        default="ignore", description="the model under which it was counted"
    )
    mounting: list[str] = Field(default=[], description="what a real mount would not allow")
    by_occlusion_percent: dict[Occlusion, Percent] = Field(
        default={}, description="zeta under each model"
    )
    unseeing: list[UnseeingModel] = Field(
        default=[], description="sensors that see next to nothing"
    )
    poses: list[PoseZetaModel] = Field(default=[], description="each by itself")
    sensors: list[SensorRecord] = Field(default=[], description="of the catalogue")
    separation: SeparationModel | None = Field(default=None, description="of V_P")
    seconds: float = Field(ge=0, description="that the count took")


class ErrorsModel(StrictModel):
    """Errors of mounting: limits (uniform) or twice the standard deviations (normal) of each ring's
    place along its link and of each ring's and each sensor's direction; how many mountings were
    drawn, by which seed."""

    position_mm: float = Field(default=5.0, ge=0, le=1000, description="millimetres along the link")
    direction_deg: float = Field(default=2.0, ge=0, le=45, description="degrees")
    law: Literal["uniform", "normal"] = "uniform"
    draws: int = Field(default=100, ge=1, le=100_000, description="mountings")
    seed: int = Field(default=0, ge=0)


class ShareModel(StrictModel):
    """A share of approaches and its interval of 95 % (Wilson)."""

    percent: Percent
    low_percent: Percent
    high_percent: Percent


class DirectionModel(ShareModel):
    """Of the approaches from between two azimuths, degrees from +x towards +y, base frame."""

    from_deg: float
    to_deg: float
    approaches: int


class SafetyResult(StrictModel):
    """What ``safety --json`` prints: the share of approaches reported in time, by direction, and if
    the sensors saw as far as is asked; what was asked, with each term; what the sensors see, and
    how late they say so. No safety rating follows."""

    setup: str
    approaches: int
    moments: int
    seconds_of_motion: float | None = None
    in_time: ShareModel
    if_far_enough: ShareModel | None = None
    never_reported: int
    nearest_report_m: float | None = None
    by_direction: list[DirectionModel]
    separation: SeparationModel
    separation_at_report_m: float
    period_s: float
    latency_s: float
    rate_assumed: bool
    range_m: float
    range_needed_m: float
    range_suffices_percent: Percent
    occlusion: Literal["shadow", "blind", "ignore"]
    obstacles: list[str] = []
    floor_m: float
    seed: int
    sensors: list[SensorRecord]
    disclaimer: str
    seconds: float = Field(ge=0)


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


class PrintCheck(StrictModel):
    """Something measured on a printed ring, what is allowed, and whether it holds."""

    name: str
    measured: float
    least: float | None = None
    most: float | None = None
    unit: str = ""
    holds: bool


class PrintedRing(StrictModel):
    """A printed ring: its files, where it goes, what else it takes, and what was measured of it."""

    ring: int = Field(ge=0, description="counted from 0")
    link: str
    position_mm: float = Field(
        description="of its lenses from the mount's proximal end, along the link"
    )
    count: int
    tilt_deg: float
    radius_mm: float
    bore_mm: float = Field(description="diameter")
    size_mm: list[float] = Field(description="of the larger half as it is printed")
    flipped: bool = Field(description="mounted with its bed side towards distal")
    board: str = Field(description="where its figures are from")
    screws: str
    bolts: str
    files: list[str]
    checks: list[PrintCheck]


class PrintResult(StrictModel):
    """What ``export --to stl`` leaves in printing.json."""

    rings: list[PrintedRing]
    assembled: str = Field(description="picture of the first ring with boards and link")
