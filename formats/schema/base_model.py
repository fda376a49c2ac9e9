"""Base model of all files: unknown keys and type conversions are rejected, and errors state the
allowed values."""

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from ..errors import shown


class StrictModel(BaseModel):
    """Base of all models: unknown keys are rejected, values are not converted, and instances are
    immutable."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # a command uses few of all models
    )

    def stated(self) -> dict[str, Any]:
        """Return the keys that a TOML file of the model states."""
        return self.model_dump(mode="json")


def fault(found: Any, allowed: str) -> PydanticCustomError:
    """Return an error for a validator, with the value found and the values allowed."""
    return PydanticCustomError(
        "rule", "found {found}, allowed: {allowed}", {"found": shown(found), "allowed": allowed}
    )


Fault = tuple[tuple[int | str, ...], Any, str]
"""The key at fault, the value found there, and the values allowed."""


def refuse(faults: Iterable[Fault]) -> None:
    """Raise one ValidationError for all faults, if there are any.

    Args:
        faults: the faults, in the order of the message.
    """
    details = [
        InitErrorDetails(type=fault(found, allowed), loc=loc, input=None)
        for loc, found, allowed in faults
    ]
    if details:
        raise ValidationError.from_exception_data("file", details)
