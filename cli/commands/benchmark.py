"""The command benchmark."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..options.common import Json


def benchmark(
    question: Annotated[str | None, Parameter(help="Name of a question. Default: all.")] = None,
    /,
    *,
    score: Annotated[
        Path | None,
        Parameter(
            help=(
                "Answer to score: a CSV of rings (link,position,count,tilt_deg,phase_deg), a list"
                " of sensors as place-rings cones prints it, or a proposal (.toml). A folder: all"
                " files in it, each called like its question."
            )
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help=(
                "Output folder: for the scenes of the questions (QUESTION.toml), or with --score"
                " for the answers with their values (QUESTION.csv), ready to be entered."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the questions of the benchmark, write their scenes, or score your answers.

    An answer is a setup of rings with at most the question's number of sensors. Its value is the
    coverage in percent, counted in voxels of 1 cm, beside an interval that is proven to hold the
    exact share; it is judged against all rules. The exit code is 1 if an answer breaks one.

    For example:

    ```bash
    place-rings benchmark
    place-rings benchmark shell_48 --out questions
    place-rings benchmark shell_48 --score mine.csv
    place-rings benchmark --score answers
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs import benchmark as runs

    if score is not None:
        sys.exit(runs.score(question, score, out, as_json))
    runs.listed(question, out, as_json)
