"""The command improve."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...placement.search.options import ImproveOptions
from ..options.common import Floors, Json, Subject
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions
from ..options.offered import offering


@offering()
def improve(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    options: ImproveOptions,
    at_least: Floors = (),
    mounted: FrameOptions = NO_FRAMES,
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
    from place_rings._validation import ResolvedSetup

    from ..options.targets import with_floors
    from ..runs.improve import improve as run

    setup, scene = SubjectOptions(place, mounted=mounted).resolve(subject)
    run(ResolvedSetup(subject, setup, with_floors(scene, at_least)), options, out, as_json)
