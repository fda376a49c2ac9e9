"""The models of what ``verify --json`` prints: counts and proofs, in percent."""

from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from ...coverage.occlusion.model import Occlusion
from ...coverage.rings.rounding import degrees
from ...objectives.occlusion import Unseeing
from ...objectives.scene import Scene
from ...objectives.verify import PoseZeta, Verified
from .base_model import StrictModel
from .field_types import Metres, Percent
from .mapping import COVERAGE, MappedModel, Of, rounded_millimetres
from .sensor_records import SensorRecord
from .separation_models import SeparationModel


class ProofModel(StrictModel):
    """How a certified interval was reached: the width asked for, in points (0: none, cells of one
    side), whether it was reached, passes, cells of the last pass, and the side of the smallest, m.
    Over several poses: the most, the sum, the least."""

    width_percent: Percent
    reached: bool
    passes: int
    cells: int
    smallest: Metres

    @classmethod
    def of(cls, verified: Verified) -> Self | None:
        """Return the record of a certified interval over all poses; None by another rule."""
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


class PoseZetaModel(MappedModel[PoseZeta]):
    weight: float
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)]
    low_percent: Annotated[Percent, Of("low", COVERAGE)]
    high_percent: Annotated[Percent, Of("high", COVERAGE)]
    target_voxels: int | None = None
    covered_voxels: int | None = None


class WorstModel(MappedModel[PoseZeta]):
    """The pose with the least zeta: which (from 0), when the record was there, and its joint
    angles.
    """

    pose: int = Field(ge=0)
    time_s: float | None = None
    q_deg: list[float]
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)]
    low_percent: Annotated[Percent, Of("low", COVERAGE)]
    high_percent: Annotated[Percent, Of("high", COVERAGE)]


class UnseeingModel(MappedModel[Unseeing]):
    """A sensor that sees less than 1 % of its cone, or nothing as it stands within something: at
    how many poses, within what, and how deep at most."""

    ring: int
    sensor: int
    poses: int
    within: str | None = None
    depth_mm: Annotated[float, Of("depth", rounded_millimetres(3))] = 0.0

    @classmethod
    def from_domain(cls, value: Unseeing, **given: Any) -> Self:
        """Return the record of a sensor that is blocked."""
        return super().from_domain(value, poses=len(value.poses), **given)


_LOW = Field(description="percent, of the guaranteed interval; by another rule zeta itself")
_HIGH = Field(description="percent, likewise")


class VerifyResult(MappedModel[Verified]):
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
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)] = Field(
        description="percent, mean over the poses"
    )
    low_percent: Annotated[Percent, Of("low", COVERAGE)] = _LOW
    high_percent: Annotated[Percent, Of("high", COVERAGE)] = _HIGH
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

    @classmethod
    def of(cls, name: str, verified: Verified, scene: Scene | None = None) -> Self:
        """Return the record of a verified zeta of the setup called ``name``; the ``scene`` tells
        more of the worst of its poses, and of the distances that V_P is made of.
        """
        poses, target = () if scene is None else scene.poses, verified.target
        worst = verified.worst
        return cls.from_domain(
            verified,
            setup=name,
            target=target.name,
            radius=target.radius,
            proof=ProofModel.of(verified),
            separation=None if scene is None else SeparationModel.of(scene, target),
            worst=WorstModel.from_domain(
                verified.poses[worst],
                pose=worst,
                time_s=poses[worst].time_s,
                q_deg=[degrees(angle) for angle in poses[worst].q],
            )
            if len(poses) > 1
            else None,
        )

    def with_occlusion(
        self,
        scene: Scene,
        zetas: dict[Occlusion, float],
        blocked: Iterable[Unseeing] = (),
    ) -> Self:
        """Return the record with the scene's model of occlusion, zeta in [0, 1] under each, and the
        sensors that are blocked.
        """
        return self.model_copy(
            update={
                "occlusion": scene.occlusion,
                "by_occlusion_percent": {name: COVERAGE.write(z) for name, z in zetas.items()},
                "unseeing": [UnseeingModel.from_domain(one) for one in blocked],
            }
        )
