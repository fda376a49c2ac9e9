"""The models of proposals, of how they were found, and of the records that stand beside them."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from .base_model import StrictModel, refuse
from .field_types import Percent
from .print_models import PrintResult
from .redesign_models import ImproveResult
from .result_models import VerifyResult
from .ring_models import RingModel, ring_models
from .robot_models import RobotFile, robot_of
from .robustness_models import ErrorsModel, RobustnessResult
from .scene_models import SceneFile, SceneModel
from .sensor_pose_models import SensorPosesFile
from .sensor_records import SensorRecord
from .separation_models import SafetyResult
from .versions import VersionedFile


class FoundModel(StrictModel):
    """How a proposal was found: for which number of sensors that see a point, which loss, and which
    errors of mounting."""

    outcome: str = Field(description="how the search ended")
    seed: int
    soft_percent: float = Field(
        description="percent, the search's own estimate of what was asked for"
    )
    exact_percent: Percent = Field(description="percent, the same counted")
    width: float = Field(description="metres, of the sigmoid of soft_percent")
    starts: int = Field(description="that were tried")
    evaluations: int = Field(description="of the soft estimate")
    seconds: float = Field(description="on the wall")
    command: str = Field(description="that made the file")
    created: str = Field(description="when, UTC")
    versions: dict[str, str] = Field(description="of the packages that matter")
    redundancy: int = Field(default=1, ge=1, description="sensors")
    losing: Literal["ring", "sensor"] | None = Field(default=None, description="what is lost")
    tolerant: ErrorsModel | None = Field(default=None, description="errors that were kept in mind")


class ProposalFile(VersionedFile):
    """A proposal (TOML): the setup first, then the scene it is for, its verified zeta, and how it
    was found.
    """

    rings: list[RingModel] = Field(min_length=1, max_length=1000)
    scene: SceneModel = SceneModel()
    zeta: list[VerifyResult] = Field(default=[])
    found: FoundModel | None = None

    @classmethod
    def of(cls, setup: Setup, scene: Scene, **more: Any) -> Self:
        """Return the proposal of a setup for a scene, with ``more`` keys."""
        rings = ring_models(setup, scene.sensor)
        return cls(rings=rings, scene=SceneModel.from_domain(scene), **more)

    @model_validator(mode="after")
    def _on_the_robot(self) -> Self:
        robot = robot_of(self.scene.robot)
        refuse(
            (("rings", i, "link"), ring.link, f"a link of {robot.name}: {', '.join(robot.links)}")
            for i, ring in enumerate(self.rings)
            if ring.link not in robot.links
        )
        return self


class ReachedModel(StrictModel):
    sensors: int
    exact_percent: Percent
    reached: bool


class ReachModel(StrictModel):
    """What searches for fewest sensors came to, one by one."""

    wanted_percent: Percent
    reached: bool
    tried: list[ReachedModel]


class SearchFile(VersionedFile):
    """``result.json`` of a search: the proposal, and its zeta beside the paper's setups by the same
    verifier; the same of what was asked for, where that was not zeta itself."""

    proposal: ProposalFile
    soft_minus_exact_percent: float
    comparison: list[VerifyResult]
    asked_percent: dict[str, Percent] = Field(default={})
    files: dict[str, str]
    short_percent: float = Field(default=0.0, ge=0, description="points by which floors are missed")
    reach: ReachModel | None = None
    sensors: list[SensorRecord] = Field(default=[])


MODELS: dict[str, type[StrictModel]] = {
    "scene": SceneFile,
    "robot": RobotFile,
    "proposal": ProposalFile,
    "verify": VerifyResult,
    "robustness": RobustnessResult,
    "result": SearchFile,
    "improve": ImproveResult,
    "safety": SafetyResult,
    "sensors": SensorPosesFile,
    "printing": PrintResult,
}
