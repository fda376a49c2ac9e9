"""Options of ``check``, in groups: its rig, its files, its parts, and what it does in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError
from .common import WHOLE
from .panels import RIG_FILES

if TYPE_CHECKING:  # imported when the options are resolved
    from ...rig.check.offline import FileOptions
    from ...rig.check.plans import CheckOptions, Part


@Parameter(name="*")
@dataclass(frozen=True)
class RigOptions:
    """The rig that a check connects to, or its recording."""

    rig: Annotated[
        Literal["sim"] | None,
        Parameter(help="sim: check a simulated robot with randomly misplaced rings."),
    ] = None
    injected: Annotated[
        Literal["random", "none"],
        Parameter(
            help="Errors and faults of the simulated rig: random ones by --seed, or none at all."
        ),
    ] = "random"
    robot_host: Annotated[
        str | None, Parameter(help="Host name or address of the robot's controller.")
    ] = None
    ring: Annotated[
        tuple[str, ...],
        Parameter(
            name="--ring",
            negative=(),
            help=(
                "Serial port of a ring: NAME=PORT[,DECODER[,BAUD]], for example tool=/dev/ttyUSB0."
                " Repeat it for every ring. A ring has the name of its link, or forearm.0,"
                " forearm.1 where a link carries several."
            ),
        ),
    ] = ()
    replay: Annotated[
        Path | None, Parameter(help="Recording of an earlier check (.rig) to assess again.")
    ] = None

    def refuse_unfit(self) -> None:
        """Raise UserError if an option fits no other option or value."""
        if self.rig is None and self.injected != "random":
            raise UserError("--injected: allowed only with --rig sim")
        if self.robot_host == "":
            raise UserError('--robot-host: found "", allowed: a host name or an address')


@Parameter(name="*", group=RIG_FILES)
@dataclass(frozen=True)
class RigFileOptions:
    """The files of a check without a rig, and of its plans."""

    joints: Annotated[
        Path | None,
        Parameter(help="The robot's joint states, in a ROS 2 bag, an MCAP file or a CSV file."),
    ] = None
    readings: Annotated[
        Path | None,
        Parameter(help="The sensors' readings, in a file of their own. Default: the same."),
    ] = None
    steps: Annotated[
        Path | None,
        Parameter(
            help=(
                "When the steps of the check took place, in a file of its own."
                " Default: a topic of the bag or MCAP file."
            ),
        ),
    ] = None
    names: Annotated[
        tuple[str, ...],
        Parameter(
            name="--map",
            negative=(),
            help=(
                "NAME=SOURCE, where a joint, ring, sensor or the topic of the steps"
                " has another name in the files, for example"
                " forearm=/forearm/range_{sensor}. Repeatable."
            ),
        ),
    ] = ()
    plan: Annotated[
        Path | None,
        Parameter(
            help=(
                "Folder of the plans that the steps follow, as --plan-only writes"
                " them. Default: the stops are where the robot stood still."
            ),
        ),
    ] = None
    plan_only: Annotated[
        bool, Parameter(negative=(), help="Write the plans of stops and trials, and end.")
    ] = False

    def options(self, parts: "PartOptions", voxel: float, seed: int) -> "FileOptions | None":
        """Return the files and parts to assess; None without --joints."""
        from ...rig.check.offline import FileOptions

        if self.joints is None:
            return None
        return FileOptions(
            *(self.joints, self.readings, self.steps, self.plan, self.names),
            *(parts.chosen(), bool(parts.part), voxel, seed),
        )


@Parameter(name="*")
@dataclass(frozen=True)
class PartOptions:
    """The parts of a check, whether it runs or is only shown, and whether it moves the robot."""

    dry_run: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Show every pose and way of the check in a browser, at full speed or a tenth of it,"
                " and what to set on the controller before a first move. Nothing is connected."
            ),
        ),
    ] = False
    browser: Annotated[
        bool, Parameter(negative="--no-browser", help="With --dry-run: open the page in a browser.")
    ] = True
    part: Annotated[
        tuple[Literal["self", "mount", "coverage"], ...],
        Parameter(
            name="--part",
            negative=(),
            help="Run only this part. Repeatable. Default: all three.",
        ),
    ] = ()
    move: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Move the real robot slowly, after you confirm and after the self check, which runs"
                " with every part. Default: you move it with the pendant."
            ),
        ),
    ] = False
    allow_reduced_near_stop: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Move although too few sensors stop the robot at the full distance (near_share in"
                " [motion] of the scene)."
            ),
        ),
    ] = False

    allow_differing_self_check: Annotated[
        bool,
        Parameter(
            negative=(),
            help="Move although the self check found sensors that differ from the proposal.",
        ),
    ] = False

    def refuse_unfit(self) -> None:
        """Raise UserError if an option needs another one."""
        if self.allow_reduced_near_stop and not self.move:
            raise UserError("--allow-reduced-near-stop: allowed only with --move")
        if self.allow_differing_self_check and not self.move:
            raise UserError("--allow-differing-self-check: allowed only with --move")
        if not self.browser and not self.dry_run:
            raise UserError("--no-browser: allowed only with --dry-run")

    def chosen(self) -> "tuple[Part, ...]":
        """Return the parts to run."""
        from ...rig.check.plans import PARTS

        return self.part or PARTS


@Parameter(name="*")
@dataclass(frozen=True)
class ExtentOptions:
    """How much is done in each part of a check."""

    wave: Annotated[
        bool,
        Parameter(
            negative=(),
            help="In the self check, identify the sensors by a hand that passes them.",
        ),
    ] = False
    seconds: Annotated[
        float,
        Parameter(validator=Number(gt=0, lte=3600), help="Duration of the self check in seconds."),
    ] = 5.0
    stops: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=3, lte=1000), help="Number of robot poses in the mount check."
        ),
    ] = 24
    trials: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=2, lte=10_000),
            help="Number of rod positions in the coverage check, over all targets.",
        ),
    ] = 120
    rod_mm: Annotated[str, Parameter(help="Size of the test rod: THICKNESSxLENGTH in mm.")] = (
        "70x370"
    )

    def options(
        self, rig: RigOptions, parts: PartOptions, voxel: float, seed: int
    ) -> "CheckOptions":
        """Return the parts and settings of a check on a rig; raise UserError if they do not fit."""
        from ...rig.check.plans import CheckOptions
        from .rig import resolve_rod

        chosen = parts.chosen()
        if self.wave and "self" not in chosen:
            raise UserError("--wave: allowed only with --part self, or without --part")
        return CheckOptions(
            *(chosen, self.seconds, self.wave, self.stops, self.trials, resolve_rod(self.rod_mm)),
            *(parts.move, parts.allow_reduced_near_stop, voxel, seed, rig.injected),
            parts.allow_differing_self_check,
        )


NO_RIG, NO_FILES, ALL_PARTS, USUAL_EXTENT = (
    RigOptions(),
    RigFileOptions(),
    PartOptions(),
    ExtentOptions(),
)


def check_options_fit(
    rig: RigOptions,
    files: RigFileOptions,
    parts: PartOptions,
    extent: ExtentOptions,
    where: Mapping[str, object],
    bag: bool,
) -> None:
    """Raise UserError unless a check has exactly one way to its data, and no option of another.

    Args:
        rig, files, parts, extent: the options.
        where: the options of scene and count, by name; false where they are not given.
        bag: whether to write a bag.
    """
    from .rig import check_way

    check_way(
        {
            "--rig sim": rig.rig,
            "--robot-host HOST": rig.robot_host,
            "--replay FILE": rig.replay,
            "--joints FILE": files.joints,
            "--plan-only": files.plan_only or None,
            "--dry-run": parts.dry_run or None,
        },
        {
            "--robot-host HOST": {"ring": rig.ring, "move": parts.move},
            "--joints FILE": {
                "readings": files.readings,
                "steps": files.steps,
                "map": files.names,
                "plan": files.plan,
            },
        },
    )
    rig.refuse_unfit()
    parts.refuse_unfit()
    changed = [f.name for f in fields(extent) if getattr(extent, f.name) != f.default]
    if rig.replay is not None:
        given = [*(name for name, value in where.items() if value), *["part"] * bool(parts.part)]
        _refuse([*given, *changed], "--replay FILE, whose recording states it")
    if files.joints is not None:
        _refuse(changed, "--joints FILE: the files, or the plans of --plan, state it")
    if bag:
        from ...formats.export.ros2_bag import require_rosbags

        if (rig.rig, rig.robot_host, rig.replay) == (None, None, None):
            ways = "--rig sim, --robot-host HOST or --replay FILE"
            raise UserError(f"--bag: allowed only with {ways}")
        require_rosbags("--bag")


def _refuse(names: Sequence[str], way: str) -> None:
    """Raise UserError about the first of the options that a way to the data excludes."""
    for name in names[:1]:
        raise UserError(f"--{name.replace('_', '-')}: not allowed with {way}")
