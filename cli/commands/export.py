"""The command export: a setup for other programs."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

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
    from ..._export import export as write
    from ..._export import formats_of
    from ..._validation import ResolvedSetup
    from ...formats.loader import resolve
    from ...reporting.terminal import say
    from ..options.scenes import resolve_scene, urdf_of

    formats_of(to)
    placed = resolve(subject, resolve_scene(scene, robot), frames=mounted.resolve())
    files = write(
        ResolvedSetup(subject, *placed),
        to=to,
        folder=out,
        pose=pose,
        urdf=urdf or urdf_of(robot),
        packages=packages,
        points=points,
        keep=[path for path in (subject, scene, robot) if path is not None],
    )
    for file in files:
        say(str(file))
