"""Options of a check: what the command line offers, and what plans and procedure follow."""

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import Faults
from ...coverage.definitions.errors import UserError, shown
from ...reporting.options import WHOLE

if TYPE_CHECKING:  # imported when a rod is made
    from ..rod.rod import Rod

Part = Literal["self", "mount", "coverage"]
PARTS: tuple[Part, ...] = ("self", "mount", "coverage")
_ROD = re.compile(r"(?P<thick>\d+(\.\d+)?)x(?P<long>\d+(\.\d+)?)")


@dataclass(frozen=True)
class RigOptions:
    """Where a check finds its rig, or its recording."""

    rig: Literal["sim"] | None = None
    """sim: check a simulated robot with randomly misplaced rings."""
    robot_host: str | None = None
    """Host name or address of the robot's controller."""
    ring: tuple[str, ...] = ()
    """Serial port of a ring: NAME=PORT[,DECODER[,BAUD]], for example tool=/dev/ttyUSB0. Repeat it
    for every ring. A ring has the name of its link, or forearm.0, forearm.1 where a link carries
    several."""
    replay: Path | None = None
    """Recording of an earlier check (.rig) to assess again."""
    dry_run: bool = False
    """Show every pose and way of the check in a browser, at full speed or a tenth of it, and what
    to set on the controller before a first move. Nothing is connected."""
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True
    """With --dry-run: open the page in a browser."""


@dataclass(frozen=True)
class FileOptions:
    """The files of a check without a rig, and of its plans."""

    joints: Path | None = None
    """The robot's joint states, in a ROS 2 bag, an MCAP file or a CSV file."""
    readings: Path | None = None
    """The sensors' readings, in a file of their own. Default: the same."""
    steps: Path | None = None
    """When the steps of the check took place, in a file of its own. Default: a topic of the bag or
    MCAP file."""
    names: Annotated[tuple[str, ...], Parameter(name="--map")] = ()
    """NAME=SOURCE, where a joint, ring, sensor or the topic of the steps has another name in the
    files, for example forearm=/forearm/range_{sensor}. Repeatable."""
    plan: Path | None = None
    """Folder of the plans that the steps follow, as --plan-only writes them. Default: the stops are
    where the robot stood still."""
    plan_only: bool = False
    """Write the plans of stops and trials, and end."""


@dataclass(frozen=True)
class CheckOptions:
    """What a check does, whether it moves the robot, and how its rods and readings are counted."""

    part: tuple[Part, ...] = ()
    """Run only this part. Repeatable. Default: all three."""
    move: bool = False
    """Move the real robot slowly, after you confirm and after the self check, which runs with every
    part. Default: you move it with the pendant."""
    allow_reduced_near_stop: bool = False
    """Move although too few sensors stop the robot at the full distance (near_share in [motion] of
    the scene)."""
    allow_differing_self_check: bool = False
    """Move although the self check found sensors that differ from the proposal."""
    injected: Faults = "random"
    """What is wrong with the simulated rig: random errors and faults by --seed; turned, a cell that
    stands turned by 180° about z of the base; late, with --scheduled, a ring that fires out of step
    with the others; or none, nothing at all."""
    scheduled: bool = False
    """Expect the rings to fire in the slots of the firing schedule, with the firmware of ``export
    --to firmware --scheduled``: the self check names rings that are too slow, too fast or out of
    step, and sensors outside of their slots. A simulated rig keeps the slots."""
    wave: bool = False
    """In the self check, identify the sensors by a hand that passes them."""
    seconds: Annotated[float, Parameter(validator=Number(gt=0, lte=3600))] = 5.0
    """Duration of the self check in seconds."""
    stops: Annotated[int, WHOLE, Parameter(validator=Number(gte=3, lte=1000))] = 24
    """Number of robot poses in the mount check."""
    trials: Annotated[int, WHOLE, Parameter(validator=Number(gte=2, lte=10_000))] = 120
    """Number of rod positions in the coverage check, over all targets."""
    rod_mm: str = "70x370"
    """Size of the test rod: THICKNESSxLENGTH in mm."""
    seed: Annotated[int, WHOLE, Parameter(validator=Number(gte=0))] = 0
    """Random seed; the same seed gives the same answer."""
    voxel: float = 0.01
    """Edge length in metres of the small cubes (voxels) in which coverage is counted."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts to run."""
        return self.part or PARTS

    @property
    def moves(self) -> bool:
        """Whether the check may move a real robot."""
        return self.move and self.parts != ("self",)

    @property
    def rod(self) -> "Rod":
        """The test rod; raise UserError if its size is none."""
        from ..rod.rod import Rod

        match = _ROD.fullmatch(self.rod_mm)
        thick, long = (float(match["thick"]), float(match["long"])) if match else (0.0, 0.0)
        if not 1 <= thick <= long <= 5000:
            raise UserError(
                f"--rod-mm: found {shown(self.rod_mm)}, allowed: THICKNESSxLENGTH in mm, 1 to 5000,"
                " like 70x370"
            )
        return Rod(thick / 2000, (long - thick) / 1000)

    def changed(self, *names: str) -> list[str]:
        """Return which of the options ``names`` are not at their defaults."""
        default = {f.name: f.default for f in fields(self)}
        return [name for name in names if getattr(self, name) != default[name]]
