"""The command verify."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...objectives.options import VerifyOptions
from ..options.common import Json, Subject
from ..options.detection import NO_DETECTION, DetectionOptions
from ..options.groups import AS_IT_IS, SubjectOptions
from ..options.offered import offering


@offering()
def verify(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    options: VerifyOptions,
    detection: DetectionOptions = NO_DETECTION,
    certificate: Annotated[
        Path | None,
        Parameter(
            help=(
                "With --rule certified: file for a certificate (.npz) from which others can derive"
                " the interval again."
            )
        ),
    ] = None,
    plot_by_pose: Annotated[
        Path | None,
        Parameter(help="With several poses: file for a picture (.png) of the coverage at each."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Count the coverage of a setup with its error, or compute an interval guaranteed to hold it.

    With --detect also the expected share in which a test piece is detected.

    For example:

    ```bash
    place-rings verify n2_16_25 --target V_S --radius 0.5
    place-rings verify n2_16_25 --target V_S:0.5 --rule certified --width 1
    place-rings verify n2_16_25 --target V_S:0.5 --rule certified --certificate proof.npz
    place-rings verify n2_16_25 --trajectory motion.csv --plot-by-pose zeta.png
    place-rings verify n3_16_55 --sensor vl53l1x --ambient 50kcps
    place-rings verify n2_16_25 --sensor vl53l5cx --target V_S:0.5 --detect hand
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.verify import verify as run

    question = detection.resolve(given.sensing)
    run(given.resolved(subject), options, question, certificate, plot_by_pose, as_json)
