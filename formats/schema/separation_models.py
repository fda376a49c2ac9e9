"""Models of separation distances, and of the output of ``safety --json``."""

from typing import Annotated, Literal, Self

from pydantic import Field

from ...coverage.robots.separation_distance import Terms
from ...coverage.targets.target import Target
from ...objectives.scene import CoreScene
from ...objectives.separation_summary import separations
from .base_model import StrictModel
from .field_types import Percent
from .mapping import MappedModel, Of
from .sensor_records import SensorRecord
from .versions import VersionedFile


class SeparationModel(MappedModel[Terms]):
    """Separation distances of the robot's parts over a scene's poses. They confer no safety rating.

    The terms are those of the largest distance.
    """

    least_m: float = Field(description="smallest distance, m")
    mean_m: float = Field(description="mean over the parts and, by weight, the poses, m")
    largest_m: Annotated[float, Of("total")] = Field(description="largest distance, m")
    fastest_m_s: float = Field(description="speed of the fastest part, m/s")
    speeds_known: bool = Field(
        description=(
            "whether speeds follow from joint speeds; otherwise one speed is given for all parts"
        )
    )
    S_h: float = Field(description="distance that the person walks, m")
    S_r: float = Field(description="distance that the robot moves during the reaction time, m")
    S_s: float = Field(description="stopping distance of the robot, m")
    C: float = Field(description="intrusion distance, m")
    Z_d: float = Field(description="uncertainty of the person's position, m")
    Z_r: float = Field(description="uncertainty of the robot's position, m")
    human_speed: float = Field(description="speed of the person, m/s")
    reaction_s: float = Field(description="reaction time, s")
    stopping_s: Annotated[float, Of("stopping")] = Field(description="stopping time, s")

    @classmethod
    def of(cls, scene: CoreScene, target: Target) -> Self | None:
        """Return the record of the separation distances of V_P; None for another target."""
        distances = separations(scene, target)
        if distances is None:
            return None
        return cls.from_domain(
            distances.largest,
            least_m=distances.least,
            mean_m=distances.mean,
            fastest_m_s=distances.fastest,
            speeds_known=all(pose.rate is not None for pose in scene.poses),
            human_speed=scene.safety.human,
            reaction_s=scene.safety.reaction,
        )


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
    separation: SeparationModel = Field(description="separation distances")
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
