"""The command export."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...formats.export.options import ExportOptions
from ..options.common import (
    Json,
    PaperOption,
    RobotOption,
    SceneFileOption,
    Subject,
)
from ..options.groups import NO_FRAMES, FrameOptions
from ..options.offered import offering
from ..options.reading import AS_WRITTEN, ReadingOptions


@offering()
def export(
    subject: Subject,
    /,
    *,
    to: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help=(
                "Format: urdf, mjcf, usd, sdf, glb, csv, json, coppeliasim, ros2, mcap, stl or"
                " firmware. Repeatable; required."
            ),
        ),
    ] = (),
    out: Annotated[Path, Parameter(help="Output folder.")] = Path("place-rings-export"),
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    paper: PaperOption = False,
    urdf: Annotated[
        str | None,
        Parameter(
            help=(
                "URDF or xacro file of the robot, or a name of robot_descriptions, to which sensors"
                " are added. Default: that of --robot, if any."
            )
        ),
    ] = None,
    reading: ReadingOptions = AS_WRITTEN,
    options: ExportOptions,
    mounted: FrameOptions = NO_FRAMES,
    as_json: Json = False,
) -> None:
    """Export a setup to URDF, MJCF, USD, SDF, GLB, CSV, JSON, CoppeliaSim, ROS 2, MCAP, STL or
    firmware.

    URDF holds the robot with a frame for each sensor and the rings' bodies, MJCF with a rangefinder
    for each zone, USD with physics for Isaac Sim, SDF with a lidar for each sensor for Gazebo. GLB
    is a scene to look at, which moves if the scene has several poses, and MCAP a log of the same
    motion. STL gives the rings to print, part by part and as 3MF plates. Firmware is an Arduino
    sketch for each ring's board, with a drawing and a page that say how to wire it, and a power
    plan of all rings.

    For example:

    ```bash
    place-rings export n2_16_25 --to urdf --to mjcf --to glb --out exported
    place-rings export proposal.toml --to urdf --urdf my.urdf --out exported
    place-rings export mounted.urdf --frames "tof_.*" --beam z --to json
    place-rings export n2_16_25 --to firmware --board pico --out firmware
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._export import ExportCall, exported
    from place_rings._validation import ResolvedSetup

    from ...formats.loader import resolve
    from ...formats.schema.written_models import ExportResult
    from ...formats.writing import made_folder
    from ...reporting.terminal import say, say_json
    from ..options.scenes import scene_for, urdf_of

    urdf = urdf or urdf_of(robot)
    call = ExportCall(
        subject,
        **vars(options),
        to=to,
        folder=out,
        urdf=urdf,
        packages=reading.packages,
        keep=[path for path in (subject, scene, robot) if path is not None],
    )
    kinds, where = call.kinds, scene_for(subject, scene, robot, paper, reading, urdf)
    setup, place = resolve(subject, where, frames=mounted.resolve())
    resolved = ResolvedSetup(subject, mounted.lifted(setup, place), place)
    with made_folder(out):
        read = reading.resolve()
        call = replace(call, setup=resolved, package=read.package, xacro_args=read.xacro_args)
        files, notes = exported(call)
    for note in notes:
        say(note, error=True)
    if as_json:
        record = ExportResult(setup=subject, formats=list(kinds), files=[*map(str, files)])
        say_json(record.model_dump_json(indent=2))
        return
    for file in files:
        say(str(file))
