"""Models of target volumes: the named ones, and those of one's own."""

from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator

from ...coverage.robots.base_frame import BaseFrame
from ...coverage.targets import NAMES, OWN_NAME, WITH_RADIUS, Reachable, Target, own_name
from ...coverage.volumes import BoxVolume, CombinedVolume, FunctionVolume, Volume
from ...objectives.scene import CoreScene, Goal
from .base_model import fault
from .field_types import LONGEST_NAME, Metres
from .importance_models import ImportanceModel
from .mapping import PERCENT, MappedModel, Of
from .versions import VersionedFile
from .volume_models import VolumeModel


class TargetModel(MappedModel[Goal]):
    """A target volume with its weight and floor: a named one, or one's own."""

    volume: VolumeModel | None = Field(
        default=None, description="a volume of one's own, for a name of one's own"
    )
    importance: ImportanceModel | None = Field(
        default=None,
        description="weight field: how much each place matters; all the same if absent",
    )
    reachable: Reachable = Field(
        default=False,
        description="whether only what is connected to the robot past the obstacles counts, or"
        " only what a person can touch",
    )
    name: str = Field(
        max_length=LONGEST_NAME,
        description=f"name of the target volume: {', '.join(NAMES)}, or that of one's own",
    )
    radius: Metres | None = Field(
        default=None,
        validate_default=True,
        description="m, for V_N (distance from the robot's bodies) and V_S (of its discs) only",
    )
    weight: float = Field(
        default=1.0,
        ge=0,
        le=1e6,
        description="relative weight in the mean; 0: only its floor counts",
    )
    at_least: Annotated[float, Of(unit=PERCENT)] = Field(
        default=0.0, ge=0, le=100, description="floor of its coverage, percent"
    )

    @field_validator("volume")
    @classmethod
    def _with_an_end(cls, volume: VolumeModel | None) -> VolumeModel | None:
        if volume is not None and not volume.files and not volume.volume().bounded:
            raise fault(volume.kind, "a volume with an end; intersect a half-space with another")
        return volume

    @field_validator("reachable", mode="before")
    @classmethod
    def _by_whom(cls, found: Any) -> Any:
        if not isinstance(found, bool) and found != "person":
            raise fault(found, "true, false or person")
        return found

    @field_validator("name")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        own = info.data.get("volume") is not None
        if own and not own_name(name):
            raise fault(name, f"{OWN_NAME}, because the target has a volume of its own")
        if not own and "volume" in info.data and name not in NAMES:
            raise fault(name, f"{', '.join(NAMES)}, or any name with a volume of one's own")
        return name

    @field_validator("radius")
    @classmethod
    def _where_it_belongs(cls, radius: float | None, info: ValidationInfo) -> float | None:
        name = info.data.get("name")
        if name in WITH_RADIUS and radius is None:
            raise fault(None, f"a radius in metres, because the target is {name}")
        if name is not None and name not in WITH_RADIUS and radius is not None:
            raise fault(radius, f"no radius, because the target is {name}")
        return radius

    @property
    def files(self) -> bool:
        """Whether files still hold meshes or weights."""
        meshes = self.volume is not None and self.volume.files
        return meshes or (self.importance is not None and self.importance.file is not None)

    @property
    def target(self) -> Target:
        """The target without its weight and floor."""
        own = None if self.volume is None else self.volume.volume()
        weights = None if self.importance is None else self.importance.field()
        return Target(self.name, self.radius, own, weights, self.reachable)

    def to_domain(self, **given: Any) -> Goal:
        """Return the target with its weight and floor."""
        return super().to_domain(target=self.target, **given)

    @classmethod
    def from_domain(cls, value: Goal, **given: Any) -> Self:
        """Return the table of a target with its weight and floor.

        Raises:
            UserError: if no file can hold the target.
        """
        own, weights = value.target.volume, value.target.importance
        keys = {
            "name": value.target.name,
            "radius": value.target.radius,
            "reachable": value.target.reachable,
            "volume": None if own is None else VolumeModel.of_volume(own),
            "importance": None if weights is None else ImportanceModel.of_field(weights),
        }
        return super().from_domain(value, **keys, **given)


def boxed(scene: CoreScene) -> CoreScene:
    """Return the scene with boxes in place of the functions in its targets, which no file holds."""

    def of(volume: Volume) -> Volume:
        match volume:
            case FunctionVolume(_, (low, high)):
                x, y, z = (max(b - a, 1e-9) for a, b in zip(low, high, strict=True))
                return BoxVolume((x, y, z))
            case CombinedVolume(rule, parts):
                return CombinedVolume(rule, tuple(of(part) for part in parts))
        return volume

    goals = [
        goal
        if goal.target.volume is None
        else replace(goal, target=replace(goal.target, volume=of(goal.target.volume)))
        for goal in scene.goals
    ]
    return replace(scene, goals=tuple(goals))


def own_keys(target: Target) -> dict[str, Any]:
    """Return the keys of a target's table beyond its name and radius.

    Raises:
        UserError: if no file can hold the target.
    """
    table = TargetModel.from_domain(Goal(target))
    own = {"volume", "importance", "reachable"}
    return table.model_dump(mode="json", exclude_none=True, exclude_defaults=True, include=own)


class TargetFile(TargetModel, VersionedFile):
    """A target of one's own, for ``--target`` (TOML)."""

    base: BaseFrame | None = Field(
        default=None, description="frame of its coordinates, as the key base of a scene"
    )
