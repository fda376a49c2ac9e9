"""The command robustness."""

from typing import Annotated

from cyclopts import Parameter

from ...coverage.choices import Law
from ..options.common import Json, Seed, Subject, Voxel
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions


def robustness(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    mounted: FrameOptions = NO_FRAMES,
    k: Annotated[
        int, Parameter(name="--k", help="Tell apart up to so many sensors that see a point.")
    ] = 3,
    draws: Annotated[int, Parameter(help="Mountings that are drawn.")] = 100,
    position_error_mm: Annotated[
        float, Parameter(help="Of each ring, along its link, either way.")
    ] = 5.0,
    direction_error_deg: Annotated[
        float,
        Parameter(
            help=(
                "Of each ring as a whole (rocked two ways and turned) and of each sensor on it,"
                " either way."
            )
        ),
    ] = 2.0,
    law: Annotated[
        Law,
        Parameter(
            help=(
                "uniform: errors up to these limits. normal: the limits are two standard"
                " deviations."
            )
        ),
    ] = "uniform",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    as_json: Json = False,
) -> None:
    """Count what several sensors see, what is lost with a sensor or a ring, and ζ under errors of
    mounting.

    Example: place-rings robustness n2_16_25 --target V_S --radius 0.5
    """
    from ..._robustness import check_drawing, mounting_errors
    from ..runs.robustness import robustness as run

    mounting_errors(position_error_mm, direction_error_deg, law)
    check_drawing(k, draws)
    given = SubjectOptions(place, mounted=mounted).resolved(subject)
    errors = (position_error_mm, direction_error_deg, law)
    run(given, k, draws, *errors, seed, voxel, as_json)
