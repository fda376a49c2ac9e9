"""Models of the output of ``improve --json``: changes to a mounted setup, step by step."""

from typing import Annotated, Self

from pydantic import Field

from ...coverage.rings.ring import DIGITS_DEG, Ring, Setup
from ...coverage.rings.rounding import table_of
from ...coverage.sensors.sensor import Sensor
from ...objectives.verified import Verified
from ...placement.redesign.changes import Change, Work
from .base_model import StrictModel
from .field_types import Percent
from .mapping import MappedModel, Of, rounded_degrees, rounded_millimetres
from .scene_models import SceneModel
from .versions import VersionedFile

_MOVED = Of("moved", rounded_millimetres(3))
_TILTED = Of("tilted", rounded_degrees(DIGITS_DEG))
_TURNED = Of("turned", rounded_degrees(DIGITS_DEG))


class ChangeModel(MappedModel[Change]):
    """A change to one ring."""

    ring: int | None = Field(
        default=None, description="number of the mounted ring, counted from 0; none for a new ring"
    )
    done: str = Field(description="kind of the change")
    before: Ring | None = Field(
        default=None, description="ring before the change; none for a new ring"
    )
    after: Ring | None = Field(
        default=None, description="ring after the change; none for a removed ring"
    )
    sensors: int = Field(description="number of sensors added")
    moved_mm: Annotated[float, _MOVED] = Field(ge=0, description="displacement along the link, mm")
    tilted_deg: Annotated[float, _TILTED] = Field(ge=0, description="change of tilt, degrees")
    turned_deg: Annotated[float, _TURNED] = Field(
        ge=0, description="rotation about the link, degrees"
    )

    @classmethod
    def of(cls, change: Change, mounted: int, sensor: Sensor) -> Self:
        """Return the record of a change to a setup with ``mounted`` rings; ``sensor`` is the
        scene's."""
        before, after = (
            None if ring is None else table_of(Setup((ring,)), sensor)["rings"][0]
            for ring in (change.before, change.after)
        )
        return cls.from_domain(
            change,
            ring=change.place if change.place < mounted else None,
            done=change.kind.value,
            before=before,
            after=after,
        )


class WorkModel(MappedModel[Work]):
    """Total effort of the changes. A ring that moves to another link adds no millimetres."""

    rings_touched: Annotated[int, Of("rings")] = Field(description="number of rings touched")
    rings_carried: Annotated[int, Of("carried")] = Field(
        description="number of rings moved to another link"
    )
    sensors_added: Annotated[int, Of("sensors")] = Field(description="number of sensors added")
    moved_mm: Annotated[float, _MOVED] = Field(ge=0, description="displacement along links, mm")
    tilted_deg: Annotated[float, _TILTED] = Field(ge=0, description="change of tilt, degrees")
    turned_deg: Annotated[float, _TURNED] = Field(
        ge=0, description="rotation about the links, degrees"
    )


class StepModel(StrictModel):
    """The best setup for a number of changes."""

    exact_percent: Percent = Field(
        description="exact coverage, weighted mean over the targets, percent"
    )
    gain_percent: float = Field(description="gain over the mounted setup, percentage points")
    short_percent: float = Field(
        ge=0, description="sum by which floors are missed, percentage points"
    )
    work: WorkModel = Field(description="effort of the changes")
    changes: list[ChangeModel] = Field(description="changes")
    rings: list[Ring] = Field(description="all rings after the changes")
    zeta: list[Verified] = Field(description="verified coverage of each target")


class ImproveResult(VersionedFile):
    """Output of ``improve --json``. A number of changes without a further gain has no step."""

    setup: str = Field(description="name or file of the mounted setup")
    scene: SceneModel = Field(description="scene of the setup")
    most_changes: int = Field(description="largest number of changes")
    add_sensors: int = Field(description="largest number of additional sensors")
    outcome: str = Field(description="how the search ended")
    seed: int = Field(description="random seed")
    seconds: float = Field(ge=0, description="wall-clock time, s")
    exact_percent: Percent = Field(
        description="exact coverage as mounted, weighted mean over the targets, percent"
    )
    short_percent: float = Field(
        ge=0, description="sum by which floors are missed as mounted, percentage points"
    )
    rings: list[Ring] = Field(description="mounted rings")
    zeta: list[Verified] = Field(description="verified coverage of each target as mounted")
    broken: list[str] = Field(description="rules that the mounted setup breaks")
    steps: list[StepModel] = Field(description="best setups with a growing number of changes")
    files: dict[str, str] = Field(default={}, description="written files")
