"""The command on a rig: check."""

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError
from ..options.common import Json, Radius, SceneFileOption, Seed, Targets, Voxel


def check(
    subject: Annotated[
        str | None,
        Parameter(
            name="PROPOSAL_OR_NAME",
            help="A proposal's file or a name like n2_16_25; none with --replay.",
        ),
    ] = None,
    /,
    *,
    rig: Annotated[
        Literal["sim"] | None, Parameter(help="sim: a simulated rig, badly mounted by the seed.")
    ] = None,
    robot_host: Annotated[
        str | None, Parameter(help="Name or address of the robot's controller.")
    ] = None,
    ring: Annotated[
        tuple[str, ...],
        Parameter(
            name="--ring",
            negative=(),
            help="NAME=PORT[,DECODER[,BAUD]], for every ring: tool=/dev/ttyUSB0.",
        ),
    ] = (),
    replay: Annotated[Path | None, Parameter(help="A recording, to be judged anew.")] = None,
    part: Annotated[
        tuple[Literal["self", "mount", "coverage"], ...],
        Parameter(
            name="--part",
            negative=(),
            help="Only this part. Repeatable; all three if none is given.",
        ),
    ] = (),
    move: Annotated[
        bool,
        Parameter(
            negative=(),
            help="Let the real robot be moved, slowly, once you said yes; else you move it.",
        ),
    ] = False,
    allow_reduced_near_stop: Annotated[
        bool,
        Parameter(
            negative=(),
            help="Move although fewer sensors than near_share keep the whole near stop.",
        ),
    ] = False,
    scene: SceneFileOption = None,
    target: Targets = (),
    radius: Radius = None,
    wave: Annotated[
        bool,
        Parameter(
            negative=(),
            help="In the self check a hand passed over the sensors tells which is which.",
        ),
    ] = False,
    seconds: Annotated[
        float, Parameter(validator=Number(gt=0, lte=3600), help="Of the self check, s.")
    ] = 5.0,
    stops: Annotated[
        int, Parameter(validator=Number(gte=3, lte=1000), help="Of the mount check.")
    ] = 24,
    trials: Annotated[
        int,
        Parameter(
            validator=Number(gte=2, lte=10_000), help="Of the coverage check, over all targets."
        ),
    ] = 120,
    rod_mm: Annotated[
        str, Parameter(help="The test rod: thickness and length over all, mm.")
    ] = "70x370",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path, Parameter(help="Folder for recording, report, plans and the setup as built.")
    ] = Path("place-rings-check"),
    as_json: Json = False,
) -> None:
    """Check on a rig that a setup is mounted as proposed and sees what it should. This is no safety
    function.

    self: does every sensor answer, how often, how noisily. mount: where each ring truly sits, from
    stops in a known cell. coverage: a test rod at drawn points, seen or not. Nothing is sent to a
    real robot unless --move is given.

    Example: place-rings check n2_16_25 --rig sim

    Example: place-rings check proposal.toml --robot-host 192.0.2.7 --ring forearm.0=/dev/ttyUSB0
    --ring tool=/dev/ttyUSB1

    Example: place-rings check --replay place-rings-check/recording-1.rig --out again
    """
    from ...formats.loader import resolve
    from ...rig.check.models import PortModel
    from ...rig.check.plans import PARTS, CheckOptions
    from ..options.rig import check_installed, check_ports, resolve_ports, resolve_rod
    from ..options.scenes import resolve_scene
    from ..options.targets import parse_goals, with_goals
    from ..runs.check import check_live, check_replay

    if sum(given is not None for given in (rig, robot_host, replay)) != 1:
        raise UserError("check: allowed: one of --rig sim, --robot-host HOST, --replay FILE")
    if robot_host == "":
        raise UserError("--robot-host: found nothing, allowed: a name or an address")
    if robot_host is None and (ring or move):
        raise UserError(f"--{'ring' if ring else 'move'}: allowed: only with --robot-host")
    if allow_reduced_near_stop and not move:
        raise UserError("--allow-reduced-near-stop: allowed: only with --move")
    if replay is not None:
        sys.exit(check_replay(subject, replay, out, as_json))
    if subject is None:
        raise UserError(
            "check: found no proposal, allowed: a proposal's file or a name like n2_16_25"
        )
    parts = part or PARTS
    if wave and "self" not in parts:
        raise UserError("--wave: allowed: only with --part self")
    rod = resolve_rod(rod_mm)
    setup, given = resolve(subject, resolve_scene(scene, None))
    found = with_goals(given, parse_goals(target, radius))
    ports = list[PortModel]()
    if robot_host is not None:
        ports = resolve_ports(setup, ring)
        check_ports(setup, ports)
    check_installed()
    options = CheckOptions(
        parts, seconds, wave, stops, trials, rod, move, allow_reduced_near_stop, voxel, seed
    )
    sys.exit(check_live(subject, setup, found, options, robot_host, ports, out, as_json))
