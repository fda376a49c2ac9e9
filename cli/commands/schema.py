"""The command schema."""

import json
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from pydantic import BaseModel


def schema(
    name: Annotated[
        Literal[
            "scene",
            "robot",
            "sensor",
            "target",
            "layout",
            "proposal",
            "verify",
            "robustness",
            "result",
            "improve",
            "safety",
            "printing",
            "report",
            "export",
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
    from ...formats.schema.files import model_named
    from ...reporting.terminal import say_json

    if name == "check":  # the rig's models are its own
        from ...rig.check.models import CheckResult

        model: type[BaseModel] = CheckResult
    else:
        model = model_named(name)
    say_json(json.dumps(model.model_json_schema(), indent=2))
