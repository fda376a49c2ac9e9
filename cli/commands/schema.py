"""The command schema."""

import json
from typing import Annotated, Literal

from cyclopts import Parameter


def schema(
    name: Annotated[
        Literal[
            "scene",
            "robot",
            "proposal",
            "verify",
            "robustness",
            "result",
            "improve",
            "safety",
            "printing",
            "check",
            "sensors",
        ],
        Parameter(help="File, or command with --json, to describe."),
    ],
    /,
) -> None:
    """Print the JSON Schema of a file, or of what a command prints with --json.

    For example:

    ```bash
    place-rings schema scene
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...formats.schema.proposal_models import MODELS
    from ...reporting.terminal import say_json

    models = MODELS
    if name == "check":  # the rig's models are its own
        from ...rig.check.models import CheckResult

        models = {"check": CheckResult}
    say_json(json.dumps(models[name].model_json_schema(), indent=2))
