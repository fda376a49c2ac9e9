"""The command report."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import WHOLE, Json, Seed, Subject, Voxel
from ..options.groups import AS_IT_IS, SubjectOptions


def report(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    draws: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=100_000),
            help="Number of random mountings in the tolerance section.",
        ),
    ] = 100,
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    out: Annotated[Path, Parameter(help="Output folder for report.html.")] = Path(
        "place-rings-report"
    ),
    as_json: Json = False,
) -> None:
    """Write a report of a setup on one HTML page, to read, to print and to build from.

    The page has the coverage, the blind spots, the robustness, a mounting table and a parts list.

    For example:

    ```bash
    place-rings report place-rings-out/proposal.toml --out place-rings-out
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.report import report as run

    run(given.resolved(subject), voxel, draws, seed, out, as_json)
