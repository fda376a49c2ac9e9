"""The command export."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import (
    WHOLE,
    Json,
    PaperOption,
    RobotOption,
    SceneFileOption,
    Subject,
)
from ..options.groups import NO_FRAMES, FrameOptions
from ..options.reading import AS_WRITTEN, ReadingOptions


def export(
    subject: Subject,
    /,
    *,
    to: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help=(
                "Format: urdf, mjcf, glb, csv, json, coppeliasim, ros2 or stl."
                " Repeatable; required."
            ),
        ),
    ] = (),
    out: Annotated[Path, Parameter(help="Output folder.")] = Path("place-rings-export"),
    pose: Annotated[
        int, WHOLE, Parameter(help="Number of the scene's pose to export, from 0.")
    ] = 0,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    paper: PaperOption = False,
    urdf: Annotated[
        Path | None,
        Parameter(
            help="URDF of the robot, to which sensors are added. Default: that of --robot, if any."
        ),
    ] = None,
    reading: ReadingOptions = AS_WRITTEN,
    points: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=0, lte=1_000_000),
            help="Number of target points to draw in a glb, coloured by coverage.",
        ),
    ] = 0,
    mounted: FrameOptions = NO_FRAMES,
    as_json: Json = False,
) -> None:
    """Export a setup to URDF, MJCF, GLB, CSV, JSON, CoppeliaSim, ROS 2, or printable STL.

    URDF holds the robot with a frame for each sensor, MJCF with a rangefinder for each. GLB is a
    scene to look at, STL the rings to print.

    For example:

    ```bash
    place-rings export n2_16_25 --to urdf --to mjcf --to glb --out exported
    place-rings export proposal.toml --to urdf --urdf my.urdf --out exported
    place-rings export mounted.urdf --frames "tof_.*" --beam z --to json
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..._export import export as write
    from ..._export import formats_of
    from ..._validation import ResolvedSetup
    from ...formats.loader import resolve
    from ...formats.schema.written_models import ExportResult
    from ...reporting.terminal import say, say_json
    from ..options.scenes import scene_for, urdf_of

    kinds = formats_of(to)
    urdf = urdf or urdf_of(robot)
    where = scene_for(subject, scene, robot, paper, reading, urdf)
    setup, place = resolve(subject, where, frames=mounted.resolve())
    files = write(
        ResolvedSetup(subject, mounted.lifted(setup, place), place),
        to=kinds,
        folder=out,
        pose=pose,
        urdf=urdf,
        packages=reading.packages,
        package=reading.resolve().package,
        points=points,
        keep=[path for path in (subject, scene, robot) if path is not None],
    )
    if as_json:
        record = ExportResult(setup=subject, formats=list(kinds), files=[*map(str, files)])
        say_json(record.model_dump_json(indent=2))
        return
    for file in files:
        say(str(file))
