"""What results share: records that a command prints, and those with a version, which are files."""

import warnings
from typing import Annotated, Any, Literal

from pydantic import Field

from .definition import adapter, definition

FILE_VERSION = 2
"""Version of the files that are written."""


class JsonRecord:
    """A result as ``--json`` prints it."""

    def __getattr__(self, name: str) -> Any:
        """Return the value of a key in percent, as records had it by the key's name before."""
        if not name.endswith(("_percent", "_points")) or name not in (keys := self.model_dump()):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        message = f"{name} is now a share; or read model_dump()[{name!r}]"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return keys[name]

    def model_dump(self, mode: Literal["json", "python"] = "json") -> dict[str, Any]:
        """Return the keys and values that ``--json`` prints."""
        cls: Any = type(self)
        keys: dict[str, Any] = adapter(cls).dump_python(self, mode=mode, by_alias=True)
        return keys


@definition(kw_only=True)
class FileRecord(JsonRecord):
    """A result that is a file of its own."""

    version: Annotated[int, Field(ge=1, le=FILE_VERSION, json_schema_extra={"default": 1})] = (
        FILE_VERSION
    )
    """Version of the meaning of the keys; 1 if absent."""
