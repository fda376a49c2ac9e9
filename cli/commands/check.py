"""The command check."""

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError
from ..options.common import WHOLE, Json, Radius, SceneFileOption, Seed, Targets, Voxel


def check(
    subject: Annotated[
        str | None,
        Parameter(
            name="PROPOSAL_OR_NAME",
            help=(
                "The setup: a proposal (.toml) or a layout of the paper, for example n2_16_25. Not"
                " needed with --replay."
            ),
        ),
    ] = None,
    /,
    *,
    rig: Annotated[
        Literal["sim"] | None,
        Parameter(help="sim: check a simulated robot with randomly misplaced rings."),
    ] = None,
    robot_host: Annotated[
        str | None, Parameter(help="Host name or address of the robot's controller.")
    ] = None,
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
    ] = (),
    replay: Annotated[
        Path | None, Parameter(help="Recording of an earlier check (.rig) to assess again.")
    ] = None,
    part: Annotated[
        tuple[Literal["self", "mount", "coverage"], ...],
        Parameter(
            name="--part",
            negative=(),
            help="Run only this part. Repeatable. Default: all three.",
        ),
    ] = (),
    move: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Move the real robot slowly, after you confirm. Default: you move it with the"
                " pendant."
            ),
        ),
    ] = False,
    allow_reduced_near_stop: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Move although too few sensors stop the robot at the full distance (near_share in"
                " [motion] of the scene)."
            ),
        ),
    ] = False,
    scene: SceneFileOption = None,
    target: Targets = (),
    radius: Radius = None,
    wave: Annotated[
        bool,
        Parameter(
            negative=(),
            help="In the self check, identify the sensors by a hand that passes them.",
        ),
    ] = False,
    seconds: Annotated[
        float,
        Parameter(validator=Number(gt=0, lte=3600), help="Duration of the self check in seconds."),
    ] = 5.0,
    stops: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=3, lte=1000), help="Number of robot poses in the mount check."
        ),
    ] = 24,
    trials: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=2, lte=10_000),
            help="Number of rod positions in the coverage check, over all targets.",
        ),
    ] = 120,
    rod_mm: Annotated[
        str, Parameter(help="Size of the test rod: THICKNESSxLENGTH in mm.")
    ] = "70x370",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path, Parameter(help="Output folder for the recording, report, plans and setup as built.")
    ] = Path("place-rings-check"),
    as_json: Json = False,
) -> None:
    """Check on a robot that the rings are mounted as proposed and cover what was predicted.

    The robot is real (--robot-host), simulated (--rig sim), or recorded (--replay). The check has
    three parts:

    - self: whether every sensor answers, how often, and how noisily.
    - mount: where each ring really sits, measured from stops in a known cell.
    - coverage: whether a test rod is detected at random points.

    Nothing is sent to a real robot unless you pass --move. The exit code is 0 if the rings are as
    proposed, 1 if they differ, 3 if the check is unfinished. **This is no safety
    function.**

    For example:

    ```bash
    place-rings check n2_16_25 --rig sim
    place-rings check proposal.toml --robot-host 192.0.2.7 \\
        --ring forearm=/dev/ttyUSB0 --ring tool=/dev/ttyUSB1
    place-rings check --replay place-rings-check/recording-1.rig --out again
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...formats.loader import resolve
    from ...rig.check.models import PortModel
    from ...rig.check.plans import PARTS, CheckOptions
    from ..options.rig import check_installed, check_ports, resolve_ports, resolve_rod
    from ..options.scenes import resolve_scene
    from ..options.targets import parse_goals, with_goals
    from ..runs.check import check_live, check_replay

    if sum(given is not None for given in (rig, robot_host, replay)) != 1:
        raise UserError("check: give exactly one of --rig sim, --robot-host HOST, --replay FILE")
    if robot_host == "":
        raise UserError('--robot-host: found "", allowed: a host name or an address')
    if robot_host is None and (ring or move):
        option, hint = ("ring", "") if ring else ("move", "; a simulated robot moves without it")
        raise UserError(f"--{option}: allowed only with --robot-host HOST{hint}")
    if allow_reduced_near_stop and not move:
        raise UserError("--allow-reduced-near-stop: allowed only with --move")
    if replay is not None:
        sys.exit(check_replay(subject, replay, out, as_json))
    if subject is None:
        raise UserError(
            "check: PROPOSAL_OR_NAME is missing; give a proposal (.toml) or a name like n2_16_25"
        )
    parts = part or PARTS
    if wave and "self" not in parts:
        raise UserError("--wave: allowed only with --part self, or without --part")
    rod = resolve_rod(rod_mm)
    setup, given = resolve(subject, resolve_scene(scene, None))
    where = with_goals(given, parse_goals(target, radius))
    ports = list[PortModel]()
    if robot_host is not None:
        ports = resolve_ports(setup, ring)
        check_ports(setup, ports)
    check_installed()
    options = CheckOptions(
        parts, seconds, wave, stops, trials, rod, move, allow_reduced_near_stop, voxel, seed
    )
    sys.exit(check_live(subject, setup, where, options, robot_host, ports, out, as_json))
