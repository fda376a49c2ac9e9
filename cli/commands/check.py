"""The command check."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError
from ...rig.check.options import CheckOptions, FileOptions, RigOptions
from ..options.common import RIG_FILES, CalibrationOption, Json, Radius, SceneFileOption, Targets

_RIG, _FILES, _OPTIONS = RigOptions(), FileOptions(), CheckOptions()


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
    rig: Annotated[RigOptions, Parameter(name="*", negative=())] = _RIG,
    files: Annotated[FileOptions, Parameter(name="*", negative=(), group=RIG_FILES)] = _FILES,
    options: Annotated[CheckOptions, Parameter(name="*", negative=())] = _OPTIONS,
    scene: SceneFileOption = None,
    calibration: CalibrationOption = None,
    target: Targets = (),
    radius: Radius = None,
    out: Annotated[
        Path, Parameter(help="Output folder for the recording, report, plans and setup as built.")
    ] = Path("place-rings-check"),
    bag: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Also write the joint states, transforms and readings as a ROS 2 bag (MCAP) for"
                " Foxglove, rerun or RViz."
            ),
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Check on a robot that the rings are mounted as proposed and cover what was predicted.

    The robot is real (--robot-host), simulated (--rig sim), or recorded (--replay, or --joints with
    files of your own software). The check has three parts:

    - self: whether every sensor answers, how often, and how noisily.
    - mount: where each ring really sits, measured from stops in a known cell.
    - coverage: whether a test rod is detected at random points.

    Nothing is sent to a real robot unless you pass --move. The exit code is 0 if the rings are as
    proposed, 1 if they differ, 3 if the check is unfinished. **This is no safety
    function.**

    For example:

    ```bash
    place-rings check n2_16_25 --rig sim
    place-rings check n2_16_25 --rig sim --injected none
    place-rings check proposal.toml --robot-host 192.0.2.7 \\
        --ring forearm=/dev/ttyUSB0 --ring tool=/dev/ttyUSB1
    place-rings check proposal.toml --dry-run
    place-rings check --replay place-rings-check/recording-1.rig --out again --bag
    place-rings check proposal.toml --joints recorded.mcap
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...formats.loader import resolve
    from ...formats.optional_dependencies import require
    from ...rig.check.live import LiveCheck
    from ...rig.rings.line_monitor import Port
    from ..options.rig import check_ports, require_fit, resolve_ports
    from ..options.scenes import resolve_scene, with_calibration
    from ..options.targets import parse_goals, with_goals
    from ..runs.check import Output, check_files, check_live, check_replay, write_only

    place = {"scene": scene, "calibration": calibration, "target": target, "radius": radius}
    require_fit(rig, files, options, place, bag)
    if rig.replay is not None:
        sys.exit(check_replay(subject, rig.replay, Output(out, as_json, bag)))
    if subject is None:
        raise UserError(
            "check: PROPOSAL_OR_NAME is missing; give a proposal (.toml) or a name like n2_16_25"
        )
    setup, given = resolve(subject, resolve_scene(scene, None))
    where = with_calibration(given, calibration)
    where = with_goals(where, parse_goals(target, radius, where.robot))
    if files.joints is not None:
        sys.exit(check_files(subject, setup, where, files, options, Output(out, as_json)))
    if rig.dry_run:
        from ..runs.dry_run import show_dry_run  # loads the viewer

        show_dry_run(setup, where, options, rig.browser)
        sys.exit(0)
    if files.plan_only:
        write_only(setup, where, options, out)
        return
    ports = list[Port]()
    if rig.robot_host is not None:
        ports = resolve_ports(setup, rig.ring)
        check_ports(setup, ports)
    require("rig", "check", "rtde_receive", "rtde_control", "serial")
    live = LiveCheck.of(subject, setup, where, options, rig.robot_host)
    sys.exit(check_live(live, ports, Output(out, as_json, bag)))
