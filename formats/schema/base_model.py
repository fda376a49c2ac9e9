"""What every file's model has in common: no key unknown, no value bent into shape, faults that say
what is allowed.
"""

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from ..errors import shown


class StrictModel(BaseModel):
    """No key unknown, no value bent into shape, nothing changed once read."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # until it is used: a command uses few of all models
    )


def fault(found: Any, allowed: str) -> PydanticCustomError:
    """What was found and what is allowed, as an error of a validator."""
    return PydanticCustomError(
        "rule", "found {found}, allowed: {allowed}", {"found": shown(found), "allowed": allowed}
    )


def refuse(faults: Iterable[tuple[tuple[int | str, ...], Any, str]]) -> None:
    """Raise one error with all faults (key, what was found there, what is allowed), if there are
    any.
    """
    details = [
        InitErrorDetails(type=fault(found, allowed), loc=loc, input=None)
        for loc, found, allowed in faults
    ]
    if details:
        raise ValidationError.from_exception_data("file", details)
