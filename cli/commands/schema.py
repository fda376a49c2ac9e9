"""The command schema."""

import json
from typing import Annotated, Any, Literal

from cyclopts import Parameter


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
            "dossier",
            "facts",
            "schedule",
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
    from ...coverage.definitions.errors import schema_of
    from ...formats.schema.files import model_named
    from ...reporting.terminal import say_json

    if name == "check":  # the rig's models are its own, and load JAX
        from ...rig.check.models import CheckResult

        model: Any = CheckResult
    else:
        model = model_named(name)
    say_json(json.dumps(schema_of(model), indent=2))
