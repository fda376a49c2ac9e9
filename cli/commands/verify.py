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
        Parameter(help="Side of a voxel, m: 0.01. With --rule certified: cells of this one size."),
    ] = None,
    rule: Annotated[Rule, Parameter(help="How a voxel is counted.")] = "centre",
    width: Annotated[
        float | None,
        Parameter(help="With --rule certified: width of the guaranteed interval, in points: 0.1."),
    ] = None,
    memory: Annotated[
        float | None,
        Parameter(
            help=(
                "GB that sets of voxels may take; what needs more is streamed. Half of the free"
                " memory."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Count the exact coverage of a setup, or prove an interval that holds it.

    Example: place-rings verify n2_16_25 --target V_S --radius 0.5

    Example: place-rings verify n3_16_55 --target V_S --radius 0.5 --rule certified --width 0.01

    Example: place-rings verify n3_16_55 --sensor vl53l1x --ambient 50kcps --target-size 0.1x0.4
    """
    from ..runs.verify import verify as run

    run(given, subject, rule, voxel, width, memory, as_json)
