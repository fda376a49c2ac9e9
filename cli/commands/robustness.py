"""The command robustness."""

from ...objectives.options import RobustnessOptions
from ..options.common import Json, Subject
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions
from ..options.offered import offering


@offering()
def robustness(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    mounted: FrameOptions = NO_FRAMES,
    options: RobustnessOptions,
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
    from ..runs.robustness import robustness as run

    run(SubjectOptions(place, mounted=mounted).resolved(subject), options, as_json)
