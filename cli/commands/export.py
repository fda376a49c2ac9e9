"""The command export."""

from pathlib import Path
from typing import Annotated, Literal

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
                "Format: urdf, mjcf, glb, csv, json, coppeliasim, ros2, mcap, stl or firmware."
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
    board: Annotated[
        str | None,
        Parameter(
            help="Controller board of each ring, for firmware: esp32-s3-devkitc-1, esp32-devkit or"
            " pico. Default: the scene's."
        ),
    ] = None,
    wiring: Annotated[
        Literal["auto", "direct", "multiplexer"] | None,
        Parameter(
            help="How the sensors of a ring share its I2C bus, for firmware: direct (each XSHUT on"
            " a pin), multiplexer (each sensor on a channel), or auto (direct where the bus bears"
            " it). Default: the scene's."
        ),
    ] = None,
    mounted: FrameOptions = NO_FRAMES,
    as_json: Json = False,
) -> None:
    """Export a setup to URDF, MJCF, GLB, CSV, JSON, CoppeliaSim, ROS 2, MCAP, STL, or firmware.

    URDF holds the robot with a frame for each sensor and the rings' bodies, MJCF with a rangefinder
    for each sensor. GLB is a scene to look at, which moves if the scene has several poses, and MCAP
    a log of the same motion. STL gives the rings to print, part by part and as 3MF plates. Firmware
    is an Arduino sketch for each ring's board, with a drawing and a page that say how to wire it,
    and a power plan of all rings.

    For example:

    ```bash
    place-rings export n2_16_25 --to urdf --to mjcf --to glb --out exported
    place-rings export proposal.toml --to urdf --urdf my.urdf --out exported
    place-rings export mounted.urdf --frames "tof_.*" --beam z --to json
    place-rings export n2_16_25 --to firmware --board pico --out firmware
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._export import electronics_of, formats_of
    from place_rings._export import export as write
    from place_rings._validation import ResolvedSetup

    from ...formats.firmware.wiring import plan_setup
    from ...formats.loader import resolve
    from ...formats.schema.written_models import ExportResult
    from ...formats.writing import made_folder
    from ...reporting.terminal import say, say_json
    from ..options.scenes import scene_for, urdf_of

    kinds = formats_of(to)
    urdf = urdf or urdf_of(robot)
    where = scene_for(subject, scene, robot, paper, reading, urdf)
    setup, place = resolve(subject, where, frames=mounted.resolve())
    setup = mounted.lifted(setup, place)
    with made_folder(out):
        files = write(
            ResolvedSetup(subject, setup, place),
            to=kinds,
            folder=out,
            pose=pose,
            urdf=urdf,
            packages=reading.packages,
            package=reading.resolve().package,
            points=points,
            board=board,
            wiring=wiring,
            keep=[path for path in (subject, scene, robot) if path is not None],
        )
    if "firmware" in kinds:
        for ring in plan_setup(setup, electronics_of(place, board, wiring)):
            if ring.note:
                say(ring.note, error=True)
    if as_json:
        record = ExportResult(setup=subject, formats=list(kinds), files=[*map(str, files)])
        say_json(record.model_dump_json(indent=2))
        return
    for file in files:
        say(str(file))
