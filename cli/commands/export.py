"""The command export: a setup for other programs."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError, shown
from ..options.common import RobotOption, SceneFileOption, Subject
from ..options.groups import NO_FRAMES, FrameOptions


def export(
    subject: Subject,
    /,
    *,
    to: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(), help="urdf, mjcf, glb, csv, json, coppeliasim, ros2, stl. Repeatable."
        ),
    ] = (),
    out: Annotated[Path, Parameter(help="Folder for the files.")] = Path("place-rings-export"),
    pose: Annotated[int, Parameter(help="Pose of the scene, counted from 0.")] = 0,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    urdf: Annotated[
        Path | None,
        Parameter(
            help="The robot's own URDF, which gets the sensors; that of --robot, if it is one."
        ),
    ] = None,
    packages: Annotated[
        tuple[Path, ...],
        Parameter(negative=(), help="A folder with packages that package:// may mean. Repeatable."),
    ] = (),
    points: Annotated[
        int,
        Parameter(
            validator=Number(gte=0, lte=1_000_000), help="glb: points of each target, seen or not."
        ),
    ] = 0,
    mounted: FrameOptions = NO_FRAMES,
) -> None:
    """Write a setup for other programs: its robot with a frame for each sensor, a scene to look at,
    tables, scripts.

    Example: place-rings export n2_16_25 --to urdf --to mjcf --to glb --out exported

    Example: place-rings export proposal.toml --to urdf --urdf my.urdf --out exported

    Example: place-rings export mounted.urdf --frames "tof_.*" --beam z --to json
    """
    from ...formats.export.placed import PlacedSetup
    from ...formats.loader import resolve
    from ...formats.robots.urdf import read_urdf
    from ...formats.writing import output_folder, write_bytes
    from ...reporting.export_formats import FORMATS
    from ...reporting.terminal import say
    from ..options.scenes import resolve_scene, urdf_of

    unknown = next((name for name in to if name not in FORMATS), None)
    if unknown is not None or not to:
        raise UserError(f"--to: found {shown(unknown)}, allowed: {', '.join(FORMATS)}")
    setup, found = resolve(subject, resolve_scene(scene, robot), frames=mounted.resolve())
    if not 0 <= pose < len(found.poses):
        raise UserError(
            f"--pose: found {pose}, allowed: 0 to {len(found.poses) - 1}, the scene's poses"
        )
    urdf = urdf or urdf_of(robot)
    placed = PlacedSetup(
        found, setup, pose, out, None if urdf is None else read_urdf(urdf), packages, points
    )
    files = {
        name: data for kind in dict.fromkeys(to) for name, data in FORMATS[kind](placed).items()
    }
    read = [Path(path).resolve() for path in (subject, scene, robot, urdf) if path is not None]
    for name in files:
        if (out / name).resolve() in read:
            raise UserError(
                f"--out: found {shown(str(out / name))}, which is read here, allowed: another"
                " folder"
            )
    folder = output_folder(out)
    for name, data in files.items():
        write_bytes(folder / name, data)
        say(str(folder / name))
