"""The command improve."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import Floors, Json, Subject, Voxel
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions


def improve(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    changes: Annotated[
        int, Parameter(validator=Number(gte=1, lte=20), help="Rings touched, at most.")
    ] = 3,
    add_sensors: Annotated[
        int, Parameter(validator=Number(gte=0, lte=1000), help="Sensors more than now, at most.")
    ] = 0,
    at_least: Floors = (),
    mounted: FrameOptions = NO_FRAMES,
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")] = 0,
    time: Annotated[
        float | None, Parameter(help="Cap on the search, s; it ends by its own plan otherwise.")
    ] = None,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path | None,
        Parameter(
            help=(
                "Folder for a proposal of each step, a picture and improve.json; nothing is written"
                " without."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find the best single change to what is mounted, the best two, and so on: what each gains, and
    the work it is.

    One change is one ring touched: set anew on its link, carried to another, added, or taken away.

    Example: place-rings improve n3_16_55 --target V_S --radius 1.5

    Example: place-rings improve mounted.csv --changes 2 --add-sensors 8 --out better

    Example: place-rings improve mounted.urdf --frames "tof_.*" --target V_S --radius 1.5
    """
    from ..._search import cap_of
    from ..._validation import ResolvedSetup
    from ..options.targets import with_floors
    from ..runs.improve import improve as run

    cap_of(time)
    setup, scene = SubjectOptions(place, mounted=mounted).resolve(subject)
    mounted_setup = ResolvedSetup(subject, setup, with_floors(scene, at_least))
    run(mounted_setup, changes, add_sensors, seed, time, voxel, out, as_json)
