"""The command verify."""

from typing import Annotated

from cyclopts import Parameter

from ...coverage.choices import Rule
from ..options.common import Json, Subject
from ..options.groups import AS_IT_IS, SubjectOptions


def verify(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    voxel: Annotated[
        float | None,
        Parameter(
            help=(
                "Edge length in metres of the small cubes (voxels) in which coverage is counted."
                " Default: 0.01. With --rule certified: use cells of this size only, instead of"
                " refining them."
            )
        ),
    ] = None,
    rule: Annotated[
        Rule,
        Parameter(
            help=(
                "How to count. sampled: voxels of which a drawn point is covered; the error is"
                " computed. centre: voxels whose centre is covered. touch: voxels of which any part"
                " is covered, as in the paper. certified: compute an interval that is guaranteed to"
                " hold the coverage."
            )
        ),
    ] = "sampled",
    width: Annotated[
        float | None,
        Parameter(
            help="With --rule certified: width of the interval in percentage points. Default: 0.1."
        ),
    ] = None,
    memory: Annotated[
        float | None,
        Parameter(
            help=(
                "Memory for sets of voxels in GB; larger sets are processed in parts. Default: half"
                " of the free memory."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Count the coverage of a setup with its error, or compute an interval guaranteed to hold it.

    For example:

    ```bash
    place-rings verify n2_16_25 --target V_S --radius 0.5
    place-rings verify n2_16_25 --target V_S:0.5 --rule certified --width 1
    place-rings verify n3_16_55 --sensor vl53l1x --ambient 50kcps
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.verify import verify as run

    run(given, subject, rule, voxel, width, memory, as_json)
