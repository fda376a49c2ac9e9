"""A planned check: setup, scene and plans, as its recording stores them."""

from functools import cached_property
from typing import Annotated, Any

from pydantic import Field, ValidationError

from ...coverage.choices import Faults
from ...coverage.definitions.definition import adapter, definition, refuse
from ...coverage.definitions.errors import explain
from ...coverage.definitions.field_types import Items
from ...coverage.rings.ring import Setup
from ...formats.firmware.ring_pace import RingPace
from ...formats.firmware.ring_slots import SETTLE_S
from ...formats.schema.proposal_models import ProposalFile
from ...formats.schema.versions import FROM_FILE
from ...objectives.scene import Scene
from ..mount.stop_plan import MountPlanFile
from ..rings.line_monitor import Port
from ..rod.trial_plan import RodPlanFile
from ..simulated_cell.ground_truth import Injected, injected
from .plans import Plans

_Text = Annotated[str, Field(max_length=1000)]


@definition(kw_only=True)
class PlannedCheck:
    """A setup in a scene, and the plans of its check: the header of its recording, with everything
    that a report needs beside the readings.
    """

    name: _Text
    """Name of the setup, for display."""
    proposal: ProposalFile
    """Rings and scene."""
    seed: Annotated[int, Field(ge=0)]
    """Random seed."""
    simulated: bool
    """Whether the rig is simulated."""
    faults: Faults = "random"
    """What is wrong with a simulated rig."""
    moved: bool
    """Whether the check moves the robot."""
    stale_s: Annotated[float, Field(gt=0, le=100)]
    """Maximum age of a robot's state, s."""
    voxel: Annotated[float, Field(gt=0, le=1)]
    """Edge of the voxels in which coverage is counted, m."""
    ports: Annotated[Items[Port], Field(min_length=1, max_length=255)]
    """Ports of the rings."""
    seconds: Annotated[float, Field(gt=0, le=3600)] | None = None
    """Duration of the self check, s."""
    wave: bool = False
    """Whether a hand passes over the sensors, ring by ring."""
    paces: Annotated[Items[RingPace], Field(max_length=255)] = ()
    """When each ring sends frames by the firing schedule; none: no schedule is expected."""
    stops: MountPlanFile | None = None
    """Stops of the mount check."""
    trials: Annotated[Items[RodPlanFile], Field(max_length=100)] = ()
    """Trials of the coverage check in each target."""
    version: _Text
    """Version of the package."""

    def __post_init__(self) -> None:
        counts, rings = [port.count for port in self.ports], self.proposal.rings
        wanted = [*(ring.count for ring in rings), *(1 for _ in self.proposal.sensors)]
        if counts != wanted:
            refuse([(("ports",), f"counts {counts}", f"those of the rings, {wanted}")])
        slots = [None if pace.slots is None else len(pace.slots.slot) for pace in self.paces]
        if self.paces and len(slots) != len(counts):
            refuse([(("paces",), f"{len(slots)} rings", f"{len(counts)}, as the setup has")])
        if wrong := [n for n, c in zip(slots, counts, strict=False) if n not in (None, c)]:
            refuse([(("paces",), f"slots of {wrong[0]} sensors", "those of the ring")])
        joints = len(self.proposal.scene.robot.chain)
        if odd := {q.shape[1] for q in self.plans.poses} - {joints}:
            refuse([(("stops",), f"{max(odd)} angles", f"{joints}, as the robot has")])
        if any(plan.poses != self.trials[0].poses for plan in self.trials):
            refuse([(("trials",), "other poses for another target", "the same")])

    @staticmethod
    def _of_table(table: dict[str, Any]) -> dict[str, Any]:
        return {_NAMES.get(key, key): value for key, value in table.items()}

    def _as_table(self, table: dict[str, Any]) -> dict[str, Any]:
        keys = {name: key for key, name in _NAMES.items()}
        return {keys.get(name, name): value for name, value in table.items()}

    @staticmethod
    def read(name: str, content: object) -> "PlannedCheck":
        """Read the check from the table of a recording; raise UserError that names ``name`` if it
        is invalid.
        """
        try:
            check: PlannedCheck = adapter(PlannedCheck).validate_python(content, context=FROM_FILE)
        except ValidationError as error:
            raise explain(name, error, PlannedCheck) from error
        return check

    @property
    def header(self) -> dict[str, Any]:
        """The table of its recording."""
        table: dict[str, Any] = adapter(PlannedCheck).dump_python(self, mode="json")
        return table

    @property
    def scene(self) -> Scene:
        """Robot, cell and targets."""
        return self.proposal.scene

    @cached_property
    def setup(self) -> Setup:
        """The rings as proposed."""
        return self.proposal.setup(self.scene)

    @property
    def plans(self) -> Plans:
        """The planned parts."""
        return Plans(self.seconds, self.stops, self.trials, self.wave)

    @property
    def cycle_s(self) -> float:
        """Longest time between two readings of a sensor that fires in slots, s; 0 without one."""
        return max((p.cycle_s for p in self.paces if p.slots is not None), default=0.0)

    @property
    def settle_s(self) -> float:
        """Time that the robot stands before readings count, s: those of rings that fire in slots
        may be of the way there for longer."""
        return max([SETTLE_S, *(pace.oldest_s for pace in self.paces)])

    @property
    def injected(self) -> Injected | None:
        """Errors and faults of a simulated rig; None for a real one."""
        return injected(self.scene, self.setup, self.seed, self.faults) if self.simulated else None


_NAMES = {"setup": "name", "injected": "simulated"}
"""Keys of a recording by which Python has something else."""


def ring_names(setup: Setup) -> list[str]:
    """Name each ring and single sensor by its link or, for a single sensor, by its own name; with
    its number among those of the same name if there are several."""
    names = [getattr(group, "name", "") or group.link for group in setup.groups]
    unique: list[str] = []
    for i, name in enumerate(names):
        number = names[:i].count(name)
        own = name if names.count(name) == 1 else f"{name}.{number}"
        while own in unique or (own != name and own in names):
            number += 1
            own = f"{name}.{number}"
        unique.append(own)
    return unique
