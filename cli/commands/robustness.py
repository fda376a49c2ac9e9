"""The command robustness."""

from typing import Annotated

from cyclopts import Parameter

from ...coverage.choices import Law
from ..options.common import WHOLE, Json, Seed, Subject, Voxel
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions


def robustness(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    mounted: FrameOptions = NO_FRAMES,
    k: Annotated[
        int,
        WHOLE,
        Parameter(name="--k", help="Count the shares that at least 1, 2, … up to K sensors cover."),
    ] = 3,
    draws: Annotated[int, WHOLE, Parameter(help="Number of random mountings.")] = 100,
    position_error_mm: Annotated[
        float, Parameter(help="Largest error of each ring along its link, in mm.")
    ] = 5.0,
    direction_error_deg: Annotated[
        float,
        Parameter(
            help=(
                "Largest error in direction, in degrees: of each ring about three axes, and of each"
                " sensor on it about two."
            )
        ),
    ] = 2.0,
    law: Annotated[
        Law,
        Parameter(
            help=(
                "Distribution of the errors. uniform: within these limits. normal: the limits are"
                " two standard deviations."
            )
        ),
    ] = "uniform",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    as_json: Json = False,
) -> None:
    """Compute the coverage that remains after a failure, and with mounting errors.

    It counts the share of the target that at least 1, 2 and 3 sensors cover, the coverage without
    the most important sensor or ring, and the coverage of randomly misplaced rings.

    For example:

    ```bash
    place-rings robustness n2_16_25 --target V_S --radius 0.5
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._robustness import check_drawing, mounting_errors

    from ..runs.robustness import robustness as run

    mounting_errors(position_error_mm, direction_error_deg, law)
    check_drawing(k, draws)
    given = SubjectOptions(place, mounted=mounted).resolved(subject)
    errors = (position_error_mm, direction_error_deg, law)
    run(given, k, draws, *errors, seed, voxel, as_json)
