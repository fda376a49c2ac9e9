"""Models of proposals, of the searches that produced them, and of ``result.json``."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import Field, model_validator

from ...coverage.definitions.definition import refuse
from ...coverage.rings.mounting_errors import Mountings
from ...coverage.rings.ring import Setup
from ...coverage.rings.sensor_records import SensorRecord
from ...coverage.robots.base_frame import must_turn
from ...coverage.targets.combined import stated_keys
from ...objectives.robustness import RingSensitivity
from ...objectives.scene import Scene
from ...objectives.turned_cell import turned_single
from ...objectives.verified import Verified
from ...placement.search.progress import StageResult
from .base_model import StrictModel
from .field_types import Percent
from .gap_models import GapModel
from .motion_models import PoseModel
from .mounted_sensor_models import MountedSensorModel, single_faults, single_models, singles_of
from .price_models import PriceModel
from .ring_models import RingModel, ring_models, setup_of
from .robot_models import robot_of
from .scene_models import SceneModel
from .versions import VersionedFile

if TYPE_CHECKING:  # a search's code; most commands read a proposal without one
    from ...objectives.criterion import Criterion
    from ...placement.search.result import FewestRings, Reach, RepeatedSearch, SearchResult


class FoundModel(StrictModel):
    """The search that produced a proposal."""

    outcome: str = Field(description="how the search ended")
    seed: int = Field(description="random seed")
    soft_percent: float | None = Field(
        default=None,
        description="criterion on the search's sample points, percent; none if stopped early",
    )
    exact_percent: Percent = Field(description="exact value of the criterion, percent")
    width: float = Field(
        default=0.0,
        description="width of the sigmoid of soft_percent, m; 0 if it is a share of the points",
    )
    starts: int = Field(description="number of starts")
    evaluations: int = Field(
        default=0, description="evaluations of the soft coverage's gradient by local searches"
    )
    stages: list[StageResult] = Field(default=[], description="stages of the search")
    slope: float | None = Field(
        default=None,
        description="norm of the gradient at the end of the local stage, less what the rules forbid"
        " to follow, points by mm along the links and degrees",
    )
    seconds: float = Field(description="wall-clock time, s")
    start_up_seconds: float = Field(
        default=0.0, description="part of it before the search began, which a cap does not cut, s"
    )
    count_seconds: float = Field(
        default=0.0, description="part of it for the final count, which a cap does not cut, s"
    )
    command: str = Field(description="command that wrote the file")
    created: str = Field(description="time of creation, UTC")
    versions: dict[str, str] = Field(description="versions of the relevant packages")
    redundancy: int = Field(default=1, ge=1, description="number of sensors that must see a point")
    losing: Literal["ring", "sensor"] | None = Field(
        default=None, description="part whose worst loss the criterion assumes"
    )
    tolerant: Mountings | None = Field(default=None, description="mounting errors in the criterion")
    bound_percent: Percent | None = Field(
        default=None,
        description="upper bound of the criterion for every layout of the same budget, percent",
    )

    @classmethod
    def of(
        cls,
        result: "SearchResult",
        seed: int,
        criterion: "Criterion",
        command: str,
        versions: Mapping[str, str],
    ) -> Self:
        """Return the record of a search that has just ended.

        Args:
            result: result of the search.
            seed: random seed of the search.
            criterion: what the search maximised.
            command: the call or the command that ran it.
            versions: versions of the installed packages.
        """
        spent = result.statistics
        return cls(
            outcome=result.outcome.value,
            seed=seed,
            soft_percent=None if result.sampled is None else 100 * result.sampled,
            exact_percent=100 * result.exact,
            width=spent.width,
            starts=spent.starts,
            evaluations=spent.evaluations,
            stages=list(result.stages),
            slope=None if result.slope is None else round(100 * result.slope, 4),
            seconds=round(spent.seconds, 1),
            start_up_seconds=round(spent.start_up, 1),
            count_seconds=round(result.counting, 1),
            command=command,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            versions=dict(versions),
            redundancy=criterion.seen,
            losing=criterion.losing,
            tolerant=criterion.mountings_drawn,
        )


_EDITED = ("position", "count", "tilt_deg", "phase_deg", "radius")
"""Keys of a ring that a reader may edit, which are stated also where they have their default."""
_ALWAYS = ("robot", "occlusion", "poses", "targets", "sensor")
"""Keys of a scene that a proposal always states: some of their defaults depend on the robot."""
_TABLES = ("curve", "safety", "motion", "link", "rules", "printing")
"""Tables of a scene in which each key has a default that depends on nothing else."""
_ENDS = ("low_percent", "high_percent")


def _lean(keys: dict[str, Any], model: type[StrictModel], edited: Sequence[str] = ()) -> Any:
    """Return the keys of a table without those that have the default of ``model``."""
    fields = model.model_fields
    return {
        key: value
        for key, value in keys.items()
        if key in edited or fields[key].is_required() or value != fields[key].default
    }


def _lean_zeta(keys: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a count without an interval that is ζ itself."""
    keys = keys | {"poses": [_lean_zeta(one) for one in keys.get("poses", ())]}
    if keys.get("worst"):
        keys["worst"] = _lean_zeta(keys["worst"])
    bare = all(keys[end] == keys["zeta_percent"] for end in _ENDS)
    return {key: value for key, value in keys.items() if not (bare and key in _ENDS)}


class ProposalFile(VersionedFile):
    """A proposal (TOML): the setup first, then its scene, its verified ζ, and the search that
    produced it."""

    rings: list[RingModel] = Field(default=[], max_length=1000, description="rings of the setup")
    sensors: list[MountedSensorModel] = Field(
        default=[], max_length=1000, description="single sensors of the setup"
    )
    scene: SceneModel = Field(default=SceneModel(), description="scene of the setup")
    zeta: list[Verified] = Field(default=[], description="verified coverage of each target")
    found: FoundModel | None = Field(default=None, description="search that produced the setup")

    @classmethod
    def of(cls, setup: Setup, scene: Scene, **more: Any) -> Self:
        """Return the proposal of a setup for a scene, with further keys in ``more``."""
        rings = ring_models(setup, scene.sensor)
        singles = single_models(setup.singles, scene.sensor)
        return cls(rings=rings, sensors=singles, scene=SceneModel.from_domain(scene), **more)

    def setup(self, scene: Scene) -> Setup:
        """Return the setup; rings and sensors without a sensor or radius take those of ``scene``.

        Raises:
            ValueError: if the scene's sensor needs an ``up`` that a single sensor lacks.
        """
        rings = setup_of(self.rings, scene.sensor, scene.ring_radius).rings
        singles = singles_of(self.sensors, scene.sensor)
        if must_turn(scene.robot, self.scene.base):
            singles = tuple(map(turned_single, singles))
        return Setup(rings, singles)

    def stated(self) -> dict[str, Any]:
        """Return the keys without those that have their default or repeat another one.

        The robot, its poses, the targets, the model of occlusion and the sensor are always stated.
        """
        keys, scene = super().stated(), SceneModel().model_dump(mode="json")
        keys["rings"] = [_lean(ring, RingModel, _EDITED) for ring in keys["rings"]]
        keys["zeta"] = [_lean_zeta(one) for one in keys["zeta"]]
        if self.found is not None:
            keys["found"] = _lean(keys["found"], FoundModel)
        keys["scene"] = {
            key: (
                # some keys with their default are not even in the default's table
                {k: v for k, v in value.items() if k not in scene[key] or v != scene[key][k]}
                if key in _TABLES
                else value
            )
            for key, value in keys["scene"].items()
            if key in _ALWAYS or value != scene[key]
        }
        keys["scene"]["poses"] = [_lean(pose, PoseModel) for pose in keys["scene"]["poses"]]
        keys["scene"]["targets"] = list(map(stated_keys, keys["scene"]["targets"]))
        return keys

    @model_validator(mode="after")
    def _on_the_robot(self) -> Self:
        robot = robot_of(self.scene.robot)
        refuse(
            (("rings", i, "link"), ring.link, f"a link of {robot.name}: {', '.join(robot.links)}")
            for i, ring in enumerate(self.rings)
            if ring.link not in robot.links
        )
        refuse(single_faults(self.sensors, robot, self.scene.sensor, "sensors"))
        if not self.rings and not self.sensors:
            refuse([(("rings",), None, "one ring or single sensor, or more")])
        return self


class ReachedModel(StrictModel):
    """Result of the search with one sensor count."""

    sensors: int = Field(description="number of sensors")
    exact_percent: Percent = Field(description="exact value of the criterion, percent")
    reached: bool = Field(description="whether the coverage and all floors are reached")


class ReachModel(StrictModel):
    """Results of the searches for the fewest sensors."""

    wanted_percent: Percent = Field(description="target value of the criterion, percent")
    reached: bool = Field(description="whether any sensor count reaches it")
    tried: list[ReachedModel] = Field(description="results by sensor count")

    @classmethod
    def of(cls, reach: "Reach", wanted_percent: float) -> Self:
        """Return the record of the searches for a coverage in percent."""
        tried = [
            ReachedModel(sensors=n, exact_percent=100 * value, reached=reached)
            for n, (value, reached) in reach.tried.items()
        ]
        return cls(wanted_percent=wanted_percent, reached=reach.reached, tried=tried)


class TriedRingsModel(StrictModel):
    """Result of the search with one number of rings."""

    rings: int = Field(description="number of rings")
    exact_percent: Percent = Field(description="exact value of the criterion, percent")
    within: bool = Field(description="whether it is within the margin of the best")
    price: float | None = Field(default=None, description="price of the setup, by the scene")
    seconds: float = Field(description="duration of its search, s")
    finished: bool = Field(description="whether its search ended by itself, not by a limit")


class FewestRingsModel(StrictModel):
    """Results of the searches for the fewest rings."""

    within_points: float = Field(
        description="margin: largest loss against the best, percentage points"
    )
    tried: list[TriedRingsModel] = Field(description="results by number of rings")
    conclusive: bool = Field(
        description="whether the searches for the best and for one ring fewer than the answer"
        " ended by themselves"
    )
    untried: list[int] = Field(
        default=[], description="smaller numbers of rings for which no time was left"
    )

    @classmethod
    def of(cls, fewest: "FewestRings", scene: Scene) -> Self:
        """Return the record of the searches in a scene."""
        tried = [
            TriedRingsModel(
                rings=n,
                exact_percent=100 * one.exact,
                within=fewest.suffices(one),
                price=scene.price_of(one.setup),
                seconds=round(one.statistics.seconds, 1),
                finished=not one.cut,
            )
            for n, one in fewest.tried.items()
        ]
        return cls(
            within_points=100 * fewest.within,
            tried=tried,
            conclusive=fewest.conclusive,
            untried=list(fewest.untried),
        )


class RepeatedModel(StrictModel):
    """Result of one search of several with different random seeds."""

    seed: int = Field(description="random seed")
    exact_percent: float = Field(description="exact value of the criterion, percent")
    short_percent: float = Field(
        default=0.0, ge=0, description="sum by which floors are missed, percentage points"
    )
    best: bool = Field(description="whether it is the answer")
    seconds: float = Field(description="wall-clock time, s")

    @classmethod
    def of(cls, repeated: "RepeatedSearch | None") -> list[Self]:
        """Return the records of several searches; none of a single one."""
        if repeated is None:
            return []
        return [
            cls(
                seed=seed,
                exact_percent=100 * one.exact,
                short_percent=100 * one.short,
                best=seed == repeated.seed,
                seconds=round(one.statistics.seconds, 1),
            )
            for seed, one in repeated.tried.items()
        ]


class SearchFile(VersionedFile):
    """The file ``result.json`` of a search: the proposal, and the coverage of the paper's layouts
    by the same verifier."""

    proposal: ProposalFile = Field(description="setup, scene and search")
    soft_minus_exact_percent: float | None = Field(
        description="value on the search's sample points less the exact one, percentage points;"
        " null where there is none"
    )
    comparison: list[Verified] = Field(
        description="coverage of the proposal and of the paper's layouts"
    )
    asked_percent: dict[str, Percent] = Field(
        default={},
        description="value of the criterion for each layout, percent, unless the criterion is ζ",
    )
    files: dict[str, str] = Field(description="written files")
    short_percent: float = Field(
        default=0.0, ge=0, description="sum by which floors are missed, percentage points"
    )
    sensitivity: list[RingSensitivity] = Field(
        default=[], description="what small errors of each ring cost"
    )
    reach: ReachModel | None = Field(default=None, description="searches for the fewest sensors")
    fewest_rings: FewestRingsModel | None = Field(
        default=None, description="searches for the fewest rings"
    )
    searches: list[RepeatedModel] = Field(
        default=[], description="results of several searches by their random seeds"
    )
    gap: GapModel | None = Field(
        default=None, description="upper bound on every layout of the same budget, on request"
    )
    price: PriceModel | None = Field(
        default=None, description="price of the proposal, for a scene with prices"
    )
    sensors: list[SensorRecord] = Field(default=[], description="catalogue sensors of the setup")
