"""Definitions: frozen dataclasses that state once what there is to say about their fields.

A class under ``@definition`` is what Python users construct, what a file holds, what the command
``schema`` prints, and what the reference lists. The annotation of a field states its type and
limits, and its unit in files where that differs; the docstring under it is its line of help::

    @definition
    class Box:
        size: Point
        \"\"\"Sides along its own axes, m.\"\"\"
        turn: Annotated[float, Degrees(-360, 360, key="turn_deg")] = 0.0
        \"\"\"Rotation about z, rad.\"\"\"

Values are never converted: a text is no number, and 1.0 is no integer. Rules between fields stand
in ``__post_init__``, which calls ``refuse``. A wrong argument raises an ``InputError`` in the terms
of Python, a wrong key of a file a pydantic ``ValidationError``, which ``explain`` puts in one line.
"""

import dataclasses
from collections.abc import Callable, Iterable
from functools import cache, partial, wraps
from typing import Any, TypeVar, dataclass_transform, overload

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails, PydanticCustomError

from .docstrings import docstrings
from .errors import InputError, explain_argument, explained, schema_of, shown
from .field_types import as_python
from .units import in_file, with_keys

C = TypeVar("C")
_CONFIG = ConfigDict(
    strict=True,
    extra="forbid",
    allow_inf_nan=False,
    arbitrary_types_allowed=True,
    defer_build=True,  # a command uses few of all classes
    validate_by_name=True,
    validate_by_alias=True,
    serialize_by_alias=True,
)


@overload
def definition(cls: type[C]) -> type[C]: ...
@overload
def definition(cls: None = None, *, kw_only: bool = False) -> Callable[[type[C]], type[C]]: ...


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def definition(cls: Any = None, *, kw_only: bool = False) -> Any:
    """Return the class as a definition: a frozen dataclass that validates its fields."""
    if cls is None:
        return partial(definition, kw_only=kw_only)
    keys = with_keys(cls)
    cls.__get_pydantic_core_schema__ = classmethod(partial(_schema_of_table, keys))
    cls.__get_pydantic_json_schema__ = classmethod(partial(_with_help, keys))
    new: Any = dataclass(frozen=True, config=_CONFIG, kw_only=kw_only)(cls)
    construct = new.__init__

    @wraps(construct)
    def checked(self: Any, *args: Any, **given: Any) -> None:
        values = {name: as_python(value) for name, value in given.items()}
        try:
            construct(self, *map(as_python, args), **values)
        except ValidationError as error:
            raise explain_argument(error, type(self)) from None
        finally:
            new.__init__ = checked  # the first call builds the validator, and sets it anew

    new.__init__ = checked
    return new


def _schema_of_table(keys: dict[str, str], cls: type, source: Any, handler: Any) -> Any:
    """Return the core schema of a definition: a table of a file is also accepted, whose values in
    other units than the fields' are marked as such."""
    from pydantic_core import core_schema

    inner = node = handler(source)
    while node["type"] != "dataclass":
        node = node["schema"]
    node["strict"] = False  # the class alone; its fields stay strict
    if not keys:
        return inner
    names, of_files = {name for name, key in keys.items() if key != name}, set(keys.values())

    def marked(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        refuse(((name,), value[name], f"the key {keys[name]}") for name in names & value.keys())
        return {key: in_file(v) if key in of_files else v for key, v in value.items()}

    return core_schema.no_info_before_validator_function(marked, inner)


def _with_help(keys: dict[str, str], cls: type, schema: Any, handler: Any) -> Any:
    """Return the JSON Schema of a definition, with the docstrings of fields as descriptions."""
    whole = handler(schema)
    table = handler.resolve_ref_schema(whole)
    for name, text in field_docs(cls).items():
        key = keys.get(name, name)
        if key in table.get("properties", {}):
            text = text.replace(", rad", ", degrees") if key.endswith("_deg") else text
            table["properties"][key]["description"] = text
            _count_items(table["properties"][key])
    return whole


def _count_items(node: dict[str, Any]) -> None:
    """State limits on the length of a list as JSON Schema does; pydantic takes those of a list that
    is converted first for limits of a text."""
    for option in (node, *node.get("anyOf", ())):
        if option.get("type") == "array":
            for end in ("min", "max"):
                if (length := option.pop(f"{end}Length", None)) is not None:
                    option[f"{end}Items"] = length


def field_docs(cls: type) -> dict[str, str]:
    """Return the docstring under each field of a class and its bases, on one line, without markup
    and full stop."""
    docs: dict[str, str] = {}
    for name, text in docstrings(cls).items():
        text = text.replace("``", "").removesuffix(".")
        docs[name] = text if text[1:2].isupper() else text[:1].lower() + text[1:]
    return docs


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


@cache
def adapter(cls: Any) -> TypeAdapter[Any]:
    """Return what reads and writes a definition: ``validate_python`` of a file's keys,
    ``dump_python`` and ``json_schema``."""
    return TypeAdapter(cls)


def read_as(cls: Any, table: Any) -> Any:
    """Return a table of a file as a definition, for a validator of a value that is of several
    kinds: faults are put in words here, as the schema of the whole does not tell the kind.

    Raises:
        ValidationError: if it is not valid.
    """
    try:
        return adapter(cls).validate_python(table)
    except ValidationError as error:
        details = [
            InitErrorDetails(
                type=PydanticCustomError("rule", "{line}", {"line": line}), loc=loc, input=None
            )
            for loc, line in explained(error, schema_of(cls))
        ]
        raise ValidationError.from_exception_data("file", details) from error


def table_of(value: Any) -> dict[str, Any]:
    """Return the keys of a definition that differ from their defaults, as a file states them."""
    keys: dict[str, Any] = adapter(value.__class__).dump_python(
        value, mode="json", by_alias=True, exclude_defaults=True
    )
    return keys


__all__ = [
    "Fault",
    "InputError",
    "adapter",
    "definition",
    "fault",
    "read_as",
    "refuse",
    "table_of",
]
