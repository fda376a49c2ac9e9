"""The models of proposals, of how they were found, and of the records that stand beside them."""

from typing import Literal, Self

from pydantic import Field, model_validator

from .base_model import StrictModel, refuse
from .field_types import Percent
from .mount_models import RingModel
from .result_models import (
    ErrorsModel,
    PrintResult,
    RobustnessResult,
    SafetyResult,
    SensorRecord,
    VerifyResult,
)
from .robot_convert import robot_of
from .robot_models import RobotFile
from .scene_models import SceneFile
from .sensor_pose_models import SensorPosesFile


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


class ProposalFile(StrictModel):
    """A proposal (TOML): the setup first, then the scene it is for, its verified zeta, and how it
    was found.
    """

    rings: list[RingModel] = Field(min_length=1, max_length=1000)
    scene: SceneFile = SceneFile()
    zeta: list[VerifyResult] = Field(default=[])
    found: FoundModel | None = None

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


class SearchFile(StrictModel):
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


class ChangeModel(StrictModel):
    """A ring touched: its number as mounted (none: it is new), what was done, and the ring before
    and after (none where it is new, and where it is taken away). Millimetres along its link,
    degrees that its sensors tilt and that it turns."""

    ring: int | None = None
    done: str
    before: RingModel | None = None
    after: RingModel | None = None
    sensors: int
    moved_mm: float = Field(ge=0)
    tilted_deg: float = Field(ge=0)
    turned_deg: float = Field(ge=0)


class WorkModel(StrictModel):
    """What changes cost: the sums over them. A ring that is carried to another link counts no
    millimetres.
    """

    rings_touched: int
    rings_carried: int
    sensors_added: int
    moved_mm: float = Field(ge=0)
    tilted_deg: float = Field(ge=0)
    turned_deg: float = Field(ge=0)


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


class ImproveResult(StrictModel):
    """What ``improve --json`` prints: the setup as mounted, the scene's rules that it breaks, and
    step by step the best with ever more changes; a number of changes that gains nothing more has no
    step."""

    setup: str
    scene: SceneFile
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
