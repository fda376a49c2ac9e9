"""The command schema."""

import json
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pydantic import BaseModel


def schema(
    name: Literal[
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
    /,
) -> None:
    """Print the JSON Schema of a file or of a command's JSON.

    Example: place-rings schema scene
    """
    from ...formats.schema.files import model_named
    from ...reporting.terminal import say_json

    if name == "check":  # the rig's models are its own
        from ...rig.check.models import CheckResult

        model: type[BaseModel] = CheckResult
    else:
        model = model_named(name)
    say_json(json.dumps(model.model_json_schema(), indent=2))
