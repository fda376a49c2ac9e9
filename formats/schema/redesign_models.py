"""The models of what ``improve --json`` prints: changes to what is mounted, step by step."""

from typing import Annotated, Self

from pydantic import Field

from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import DIGITS_DEG
from ...coverage.sensors.sensor import Sensor
from ...placement.redesign.changes import Change, Work
from .base_model import StrictModel
from .field_types import Percent
from .mapping import MappedModel, Of, rounded_degrees, rounded_millimetres
from .result_models import VerifyResult
from .ring_models import RingModel, ring_models
from .scene_models import SceneModel
from .versions import VersionedFile

_MOVED = Of("moved", rounded_millimetres(3))
_TILTED = Of("tilted", rounded_degrees(DIGITS_DEG))
_TURNED = Of("turned", rounded_degrees(DIGITS_DEG))


class ChangeModel(MappedModel[Change]):
    """A ring touched: its number as mounted (none: it is new), what was done, and the ring before
    and after (none where it is new, and where it is taken away). Millimetres along its link,
    degrees that its sensors tilt and that it turns."""

    ring: int | None = None
    done: str
    before: RingModel | None = None
    after: RingModel | None = None
    sensors: int
    moved_mm: Annotated[float, _MOVED] = Field(ge=0)
    tilted_deg: Annotated[float, _TILTED] = Field(ge=0)
    turned_deg: Annotated[float, _TURNED] = Field(ge=0)

    @classmethod
    def of(cls, change: Change, mounted: int, sensor: Sensor) -> Self:
        """Return the record of a change to one of ``mounted`` rings; ``sensor`` is the scene's."""
        before, after = (
            None if ring is None else ring_models(Setup((ring,)), sensor)[0]
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
    """What changes cost: the sums over them. A ring that is carried to another link counts no
    millimetres.
    """

    rings_touched: Annotated[int, Of("rings")]
    rings_carried: Annotated[int, Of("carried")]
    sensors_added: Annotated[int, Of("sensors")]
    moved_mm: Annotated[float, _MOVED] = Field(ge=0)
    tilted_deg: Annotated[float, _TILTED] = Field(ge=0)
    turned_deg: Annotated[float, _TURNED] = Field(ge=0)


class StepModel(StrictModel):
    """The best with so many changes: points gained on the weighted mean against what is mounted,
    and points by which floors are missed; the work, the changes, and all rings with their verified
    zeta."""

    exact_percent: Percent
    gain_percent: float
    short_percent: float = Field(ge=0)
    work: WorkModel
    changes: list[ChangeModel]
    rings: list[RingModel]
    zeta: list[VerifyResult]


class ImproveResult(VersionedFile):
    """What ``improve --json`` prints: the setup as mounted, the scene's rules that it breaks, and
    step by step the best with ever more changes; a number of changes that gains nothing more has no
    step."""

    setup: str
    scene: SceneModel
    most_changes: int
    add_sensors: int
    outcome: str
    seed: int
    seconds: float = Field(ge=0)
    exact_percent: Percent
    short_percent: float = Field(ge=0)
    rings: list[RingModel]
    zeta: list[VerifyResult]
    broken: list[str]
    steps: list[StepModel]
    files: dict[str, str] = Field(default={})
