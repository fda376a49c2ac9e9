"""The version of a file: what its keys mean, and what a key means that is not there.

A file states its version; one without was written before there were versions and is of the first.
It is read before any default applies, so that an older file keeps its meaning: ``UPGRADES`` turns
its keys into those of the next version, step by step. A newer file is refused.
"""

from collections.abc import Callable
from typing import Any

from pydantic import Field, ValidationInfo, model_validator

from .base_model import StrictModel, refuse

FILE_VERSION = 1
"""Of the files that are written."""
_UNSTATED = 1
FROM_FILE = {"from_file": True}
"""Context for ``model_validate`` of what was read: keys built in code are of today's version."""


class VersionedFile(StrictModel):
    """A file that a user keeps."""

    version: int = Field(
        default=FILE_VERSION,
        ge=1,
        description="of what the keys mean; 1 if none is given",
        json_schema_extra={"default": _UNSTATED, "maximum": FILE_VERSION},
    )

    @model_validator(mode="before")
    @classmethod
    def _of_today(cls, keys: Any, info: ValidationInfo) -> Any:
        if not isinstance(keys, dict):
            return keys
        stated = _UNSTATED if info.context == FROM_FILE else FILE_VERSION
        version = keys.get("version", stated)
        if type(version) is not int or version < 1:
            return keys  # the field says what is wrong
        refuse_newer(keys)
        keys = dict(keys)
        for step in range(version, FILE_VERSION):
            keys = UPGRADES[step](cls, keys)
        return keys | {"version": FILE_VERSION}


Upgrade = Callable[[type[VersionedFile], dict[str, Any]], dict[str, Any]]
UPGRADES: dict[int, Upgrade] = {}
"""By version: the keys of a kind of file in that version, as the next version has them."""


def refuse_newer(keys: dict[str, Any]) -> None:
    """Raise ValidationError where ``keys`` are of a version that is not known yet."""
    version = keys.get("version")
    if type(version) is int and version > FILE_VERSION:
        known = "1" if FILE_VERSION == 1 else f"1 to {FILE_VERSION}"
        refuse([(("version",), version, f"{known}; update place-rings to read newer files")])
