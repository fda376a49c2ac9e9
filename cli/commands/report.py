"""The command report: a setup as a page to read, to print and to build from."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import Seed, Subject, Voxel
from ..options.groups import AS_IT_IS, SubjectOptions


def report(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    draws: Annotated[
        int,
        Parameter(validator=Number(gte=1, lte=100_000), help="Mountings drawn for the tolerance."),
    ] = 100,
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    out: Annotated[Path, Parameter(help="Folder for report.html.")] = Path("place-rings-report"),
) -> None:
    """Write a report of a setup that needs nothing else: what it sees, where it is blind, how to
    mount it, what it takes.

    Example: place-rings report place-rings-out/proposal.toml --out place-rings-out
    """
    from ..runs.report import report as run

    run(given.resolved(subject), voxel, draws, seed, out)
