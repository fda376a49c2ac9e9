"""The models of separation distances, and of what ``safety --json`` prints."""

from typing import Annotated, Literal, Self

from pydantic import Field

from ...coverage.robots.separation_distance import Terms
from ...coverage.targets import Target
from ...objectives.scene import Scene
from ...objectives.separation_summary import separations
from .base_model import StrictModel
from .field_types import Percent
from .mapping import MappedModel, Of
from .sensor_records import SensorRecord
from .versions import VersionedFile


class SeparationModel(MappedModel[Terms]):
    """The separation distances, m, of the robot's parts over a scene's poses: the least, the mean
    over the parts and, by weight, the poses, and the largest with its terms; the speed of the part
    that is fastest, m/s, and whether it follows from the joints' speeds or is the one given for
    all. No safety rating follows from them."""

    least_m: float
    mean_m: float
    largest_m: Annotated[float, Of("total")]
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
    stopping_s: Annotated[float, Of("stopping")]

    @classmethod
    def of(cls, scene: Scene, target: Target) -> Self | None:
        """Return the record of the distances that V_P is made of; None of other targets."""
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
    """A share of approaches and its interval of 95 % (Wilson)."""

    percent: Percent
    low_percent: Percent
    high_percent: Percent


class DirectionModel(ShareModel):
    """Of the approaches from between two azimuths, degrees from +x towards +y, base frame."""

    from_deg: float
    to_deg: float
    approaches: int


class SafetyResult(VersionedFile):
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
