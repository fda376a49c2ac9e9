"""The command improve."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import Floors, Json, Seed, Subject, TimeLimit, Voxel
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions


def improve(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    changes: Annotated[
        int, Parameter(validator=Number(gte=1, lte=20), help="Largest number of rings to change.")
    ] = 3,
    add_sensors: Annotated[
        int, Parameter(validator=Number(gte=0, lte=1000), help="Largest number of sensors to add.")
    ] = 0,
    at_least: Floors = (),
    mounted: FrameOptions = NO_FRAMES,
    seed: Seed = 0,
    time: TimeLimit = None,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path | None,
        Parameter(
            help=(
                "Output folder for a proposal of each number of changes, a picture and"
                " improve.json. Default: none; nothing is written."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Improve rings that are already mounted: find the best change, the best two, and so on.

    A change moves, tilts or turns one ring, carries it to another link, adds it, or removes it. The
    answer lists what each number of changes gains and how much work it is.

    For example:

    ```bash
    place-rings improve n3_16_55 --target V_S --radius 1.5
    place-rings improve mounted.csv --changes 2 --add-sensors 8 --out better
    place-rings improve mounted.urdf --frames "tof_.*" --target V_S:1.5
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._search import cap_of
    from place_rings._validation import ResolvedSetup

    from ..options.targets import with_floors
    from ..runs.improve import improve as run

    cap_of(time)
    setup, scene = SubjectOptions(place, mounted=mounted).resolve(subject)
    mounted_setup = ResolvedSetup(subject, setup, with_floors(scene, at_least))
    run(mounted_setup, changes, add_sensors, seed, time, voxel, out, as_json)
