"""Models of the output of ``safety --json``."""

from typing import Literal

from pydantic import Field

from ...coverage.rings.sensor_records import SensorRecord
from ...objectives.separation_summary import Separations
from .base_model import StrictModel
from .field_types import Percent
from .versions import VersionedFile


class ShareModel(StrictModel):
    """A share of approaches with its 95 % interval (Wilson)."""

    percent: Percent = Field(description="share, percent")
    low_percent: Percent = Field(description="lower end of the interval, percent")
    high_percent: Percent = Field(description="upper end of the interval, percent")


class DirectionModel(ShareModel):
    """The approaches between two azimuths."""

    from_deg: float = Field(
        description="lower azimuth in the base frame, degrees from +x towards +y"
    )
    to_deg: float = Field(description="upper azimuth in the base frame, degrees from +x towards +y")
    approaches: int = Field(description="number of approaches")


class SafetyResult(VersionedFile):
    """Output of ``safety --json``: the share of approaches reported in time. It confers no safety
    rating."""

    setup: str = Field(description="name or file of the setup")
    approaches: int = Field(description="number of approaches")
    moments: int = Field(description="number of moments of the motion")
    seconds_of_motion: float | None = Field(
        default=None, description="duration of the recorded motion, s"
    )
    in_time: ShareModel = Field(description="share of approaches reported in time")
    if_far_enough: ShareModel | None = Field(
        default=None, description="the same share with sensors whose range suffices"
    )
    never_reported: int = Field(description="number of approaches without a report before contact")
    nearest_report_m: float | None = Field(
        default=None, description="smallest distance at a first report, m"
    )
    by_direction: list[DirectionModel] = Field(description="shares by direction")
    separation: Separations = Field(description="separation distances")
    separation_at_report_m: float = Field(
        description="largest separation distance without period and latency, m"
    )
    period_s: float = Field(description="period of the readings, s")
    latency_s: float = Field(description="latency of a report, s")
    rate_assumed: bool = Field(description="whether a rate of readings is assumed")
    range_m: float = Field(description="range of the sensors, m")
    range_needed_m: float = Field(description="range needed, m")
    range_suffices_percent: Percent = Field(
        description="share of the moments at which the range suffices, percent"
    )
    occlusion: Literal["shadow", "blind", "ignore"] = Field(description="occlusion model")
    obstacles: list[str] = Field(default=[], description="names of the obstacles")
    floor_m: float = Field(description="height of the floor, m")
    seed: int = Field(description="random seed")
    sensors: list[SensorRecord] = Field(description="catalogue sensors of the setup")
    disclaimer: str = Field(description="statement that the result is no safety rating")
    seconds: float = Field(ge=0, description="wall-clock time, s")
