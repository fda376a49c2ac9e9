"""Models of proposals, of the searches that produced them, and of ``result.json``."""

from collections.abc import Sequence
from typing import Any, Self

from pydantic import Field, model_validator

from ...coverage.definitions.definition import adapter, refuse
from ...coverage.definitions.errors import schema_of
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.rounding import setup_faults, table_of, with_scene
from ...coverage.rings.sensor_records import SensorRecord
from ...coverage.robots.base_frame import must_turn
from ...coverage.targets.combined import stated_keys
from ...objectives.poses import PoseTable
from ...objectives.prices import SetupPrice
from ...objectives.robustness import RingSensitivity
from ...objectives.scene import Scene
from ...objectives.turned_cell import turned_single
from ...objectives.verified import Verified
from ...placement.bound.coverage_bound import CoverageBound
from ...placement.search.result import FewestRings, Reach, SearchResult, SeedResult
from .base_model import Percent
from .versions import SceneInFiles, VersionedFile

_EDITED = ("position", "count", "tilt_deg", "phase_deg", "radius")
"""Keys of a ring that a reader may edit, which are stated also where they have their default."""
_ALWAYS = ("robot", "occlusion", "poses", "targets", "sensor")
"""Keys of a scene that a proposal always states: some of their defaults depend on the robot."""
_TABLES = ("curve", "safety", "motion", "link", "rules", "printing")
"""Tables of a scene in which each key has a default that depends on nothing else."""
_ENDS = ("low_percent", "high_percent")


def _lean(keys: dict[str, Any], model: type, edited: Sequence[str] = ()) -> Any:
    """Return the keys of a table without those that have the default of ``model``."""
    known = schema_of(model)["properties"]
    return {k: v for k, v in keys.items() if k in edited or v != known[k].get("default", ...)}


def _lean_zeta(keys: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a count without an interval that is ζ itself."""
    keys = keys | {"poses": [_lean_zeta(one) for one in keys.get("poses", ())]}
    if keys.get("worst"):
        keys["worst"] = _lean_zeta(keys["worst"])
    bare = all(keys[end] == keys["zeta_percent"] for end in _ENDS)
    return {key: value for key, value in keys.items() if not (bare and key in _ENDS)}


def stated_scene(keys: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a scene without those that have their default.

    The robot, its poses, the targets, the model of occlusion and the sensor are always stated.
    """
    default = adapter(Scene).dump_python(Scene(), mode="json")
    lean = {
        key: (
            # some keys with their default are not even in the default's table
            {k: v for k, v in value.items() if k not in default[key] or v != default[key][k]}
            if key in _TABLES
            else value
        )
        for key, value in keys.items()
        if key in _ALWAYS or value != default[key]
    }
    lean["poses"] = [_lean(pose, PoseTable) for pose in keys["poses"]]
    lean["targets"] = list(map(stated_keys, keys["targets"]))
    return lean


class ProposalFile(VersionedFile):
    """A proposal (TOML): the setup first, then its scene, its verified ζ, and the search that
    produced it."""

    rings: list[Ring] = Field(default=[], max_length=1000, description="rings of the setup")
    sensors: list[MountedSensor] = Field(
        default=[], max_length=1000, description="single sensors of the setup"
    )
    scene: SceneInFiles = Field(default_factory=Scene, description="scene of the setup")
    zeta: list[Verified] = Field(default=[], description="verified coverage of each target")
    found: SearchResult | None = Field(default=None, description="search that produced the setup")

    @classmethod
    def of(cls, setup: Setup, scene: Scene, **more: Any) -> Self:
        """Return the proposal of a setup for a scene, with further keys in ``more``."""
        table = table_of(setup, scene.sensor)
        return cls(**table, scene=scene, **more)

    def setup(self, scene: Scene) -> Setup:
        """Return the setup; rings and sensors without a sensor or radius take those of ``scene``.

        Raises:
            ValueError: if the scene's sensor needs an ``up`` that a single sensor lacks.
        """
        stated = Setup(tuple(self.rings), tuple(self.sensors))
        return with_scene(stated, scene.sensor, scene.default_radius)

    def stated(self) -> dict[str, Any]:
        """Return the keys without those that have their default or repeat another one."""
        keys = super().stated()
        keys["rings"] = [_lean(ring, Ring, _EDITED) for ring in keys["rings"]]
        keys["zeta"] = [_lean_zeta(one) for one in keys["zeta"]]
        if self.found is not None:
            keys["found"] = _lean(keys["found"], SearchResult)
        keys["scene"] = stated_scene(keys["scene"])
        return keys

    @model_validator(mode="wrap")
    @classmethod
    def _of_scene(cls, keys: Any, read: Any) -> Any:
        """Check the setup on the scene's robot, in whose own base single sensors stand."""
        self = read(keys)
        setup = Setup(tuple(self.rings), tuple(self.sensors))
        refuse(setup_faults(setup, self.scene.robot, self.scene.sensor))
        if not self.rings and not self.sensors:
            refuse([(("rings",), None, "one ring or single sensor, or more")])
        scene = keys.get("scene") if isinstance(keys, dict) else None
        if isinstance(scene, dict) and must_turn(self.scene.robot, scene.get("base")):
            self.__dict__["sensors"] = [turned_single(one) for one in self.sensors]  # it is frozen
        return self


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
    reach: Reach | None = Field(default=None, description="searches for the fewest sensors")
    fewest_rings: FewestRings | None = Field(
        default=None, description="searches for the fewest rings"
    )
    searches: list[SeedResult] = Field(
        default=[], description="results of several searches by their random seeds"
    )
    gap: CoverageBound | None = Field(
        default=None, description="upper bound on every layout of the same budget, on request"
    )
    price: SetupPrice | None = Field(
        default=None, description="price of the proposal, for a scene with prices"
    )
    sensors: list[SensorRecord] = Field(default=[], description="catalogue sensors of the setup")
