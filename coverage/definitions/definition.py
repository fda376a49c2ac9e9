"""Definitions: frozen dataclasses that state once what there is to say about their fields.

A class under ``@definition`` is what Python users construct, what a file holds, what the command
``schema`` prints, and what the reference lists. The annotation of a field states its type and
limits, and its unit in files where that differs; the docstring under it is its line of help::

    @definition
    class Box:
        size: Point
        \"\"\"Sides along its own axes, m.\"\"\"
        turn: Annotated[float, Degrees("turn_deg", ge=-360, le=360)] = 0.0
        \"\"\"Rotation about z, rad.\"\"\"

A file may also state a value through others: ``_of_table`` turns the keys that a file states into
those of the fields, and ``_as_table`` those of the fields into what is written. ``_of_arguments``
completes the arguments of Python, by name. The keys of a field
that is ``INLINE``, itself a definition, stand among those of the table; a table does not state a
field that is ``ELSEWHERE``.

Values are never converted: a text is no number, and 1.0 is no integer. Rules between fields stand
in ``__post_init__``, which calls ``refuse``. A wrong argument raises an ``InputError`` in the terms
of Python, a wrong key of a file a pydantic ``ValidationError``, which ``explain`` puts in one line.
"""

import dataclasses
import inspect
import itertools
from collections.abc import Callable, Iterable
from functools import cache, partial, wraps
from typing import Any, TypeVar, dataclass_transform, get_type_hints, overload

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from pydantic_core import InitErrorDetails, PydanticCustomError

from .docstrings import docstrings
from .errors import InputError, explain_argument, explained, schema_of, shown
from .field_types import as_python
from .units import OF_SCENE, absent_in, in_file, inline_in, text_in_file, units_in, with_keys

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
    of_files = {key: name for name, key in keys.items() if key != name}
    completed = getattr(cls, "_of_arguments", None)

    @wraps(construct)
    def checked(self: Any, *args: Any, **given: Any) -> None:
        for key in given.keys() & of_files.keys():
            if units_in(new)[of_files[key]].converts:
                hint = f"(did you mean {of_files[key]}, in another unit?)"
                line = f"found an unknown argument {hint}, allowed: {', '.join(fields_of(new))}"
                raise InputError(line, f"{new.__name__}: {key}")
        values = {name: as_python(value) for name, value in given.items()}
        args, names = tuple(map(as_python, args)), new.__match_args__
        try:
            if completed is not None and len(args) <= len(names):
                args, values = (), completed(dict(zip(names, args, strict=False)) | values)
            construct(self, *args, **values)
        except ValidationError as error:
            raise explain_argument(error, type(self)) from None

    checked.__doc__ = "Set the fields, if their values are allowed."
    new._checked = checked
    _show(new)
    return new


def _show(cls: Any) -> None:
    """Let a definition be constructed as Python users see it: pydantic sets both anew whenever it
    builds the class."""
    cls.__init__, cls.__signature__ = cls._checked, _Signature()


class _Signature:
    """The signature of a definition, with the names and types of its fields: made on demand."""

    def __get__(self, _: Any, cls: Any) -> inspect.Signature:
        hints, parameters = get_type_hints(cls), []
        for field in dataclasses.fields(cls):
            stated = cls.__pydantic_fields__[field.name]
            default = stated.get_default(call_default_factory=True)
            parameters.append(
                inspect.Parameter(
                    field.name,
                    inspect.Parameter.KEYWORD_ONLY
                    if field.kw_only
                    else inspect.Parameter.POSITIONAL_OR_KEYWORD,
                    default=inspect.Parameter.empty if stated.is_required() else default,
                    annotation=hints[field.name],
                )
            )
        return inspect.Signature(sorted(parameters, key=lambda p: p.kind), return_annotation=None)


class _Marked(dict[str, Any]):
    """A table with its units marked: a class's own validator sees it again inside that of another
    class."""


def _schema_of_table(keys: dict[str, str], cls: type, source: Any, handler: Any) -> Any:
    """Return the core schema of a definition: a table of a file is also accepted, whose values in
    other units than the fields' are marked as such."""
    from pydantic_core import core_schema

    _show(cls)
    inner = node = handler(source)
    while node["type"] != "dataclass":
        if node["type"] == "function-before":
            return inner  # the schema of a class that is complete already
        node = node["schema"]
    node["strict"] = False  # the class alone; its fields stay strict
    inline, absent = inline_in(cls), absent_in(cls)
    of_scene = {name for name, meta in absent.items() if meta.value is OF_SCENE}
    of_table, as_table = (getattr(cls, name, None) for name in ("_of_table", "_as_table"))
    elsewhere = _elsewhere(cls)
    if not (keys or inline or absent or elsewhere or of_table or as_table):
        return inner
    names, of_files = {name for name, key in keys.items() if key != name}, set(keys.values())

    def marked(value: Any) -> Any:
        if not isinstance(value, dict) or isinstance(value, _Marked):
            return value
        refuse(((name,), value[name], f"the key {keys[name]}") for name in names & value.keys())
        if unknown := [
            InitErrorDetails(type="extra_forbidden", loc=(name,), input=value[name])
            for name in value
            if name in elsewhere
        ]:
            raise ValidationError.from_exception_data("file", unknown)
        table = {key: in_file(v) if key in of_files else v for key, v in value.items()}
        for name, kind in inline.items():
            if name in table:
                refuse([((name,), table[name], f"the keys {', '.join(fields_of(kind))}")])
            own = {key: table.pop(key) for key in fields_of(kind) if key in table}
            if any(v is not None for v in own.values()):
                table[name] = adapter(kind).validate_python(own)
        for name, meta in absent.items():
            if name not in table or (name in of_scene and table[name] is None):
                table[name] = meta.value
        return _Marked(of_table(table) if of_table else table)

    def written(value: Any, dump: Any, info: Any) -> Any:
        table = dump(value)
        for name in inline.keys() & table.keys():
            table |= table.pop(name) or dict.fromkeys(fields_of(inline[name]))
        for name in of_scene - table.keys():  # the default of Python's, which is none of files'
            own: Any = getattr(value, name)
            if own is not OF_SCENE:
                kind: Any = type(own)
                table[name] = adapter(kind).dump_python(own, mode=info.mode)
        table = as_table(value, table) if as_table else table
        return {k: v for k, v in table.items() if v is not None or not info.exclude_none}

    own_schema = {key: value for key, value in inner.items() if key != "ref"}
    return core_schema.no_info_before_validator_function(
        marked,
        own_schema,
        ref=inner.get("ref"),
        serialization=core_schema.wrap_serializer_function_ser_schema(
            written, info_arg=True, schema=own_schema
        )
        if inline or of_scene or as_table
        else None,
    )


def _elsewhere(cls: Any) -> list[str]:
    """Return the fields of a definition that its table does not state."""
    return [name for name, field in cls.__pydantic_fields__.items() if field.exclude]


def fields_of(cls: Any) -> tuple[str, ...]:
    """Return the names of the fields of a definition."""
    return tuple(field.name for field in dataclasses.fields(cls))


def _with_help(keys: dict[str, str], cls: type, schema: Any, handler: Any) -> Any:
    """Return the JSON Schema of a definition, with the docstrings of fields as descriptions."""
    whole = handler(schema)
    table = handler.resolve_ref_schema(whole)
    for name in _elsewhere(cls):
        table["properties"].pop(name, None)
    for name, kind in inline_in(cls).items():
        if table["properties"].pop(name, None) is None:
            continue  # a table that stands in several places is visited for each
        own = handler.resolve_ref_schema(handler(adapter(kind).core_schema))
        for key, part in own["properties"].items():
            optional = part if "default" in part else {"anyOf": [part, {"type": "null"}]}
            table["properties"][key] = {"default": None} | optional
    docs = [field_docs(kind) for kind in (cls, *inline_in(cls).values())]
    for name, text in itertools.chain(*(lines.items() for lines in docs)):
        key = keys.get(name, name)
        if key in table.get("properties", {}):
            table["properties"][key]["description"] = text_in_file(key, text)
    for name, unit in units_in(cls).items():
        default = cls.__pydantic_fields__[name].default  # type: ignore[attr-defined]
        if isinstance(default, int | float):
            table["properties"][keys[name]]["default"] = unit.to_file(default)
        if isinstance(default, tuple):
            table["properties"][keys[name]]["default"] = [unit.to_file(item) for item in default]
    for name, meta in absent_in(cls).items():
        key = keys.get(name, name)
        table["properties"][key] = meta.in_schema(table["properties"][key])
        if key in table.get("required", ()):
            table["required"].remove(key)
    for part in table["properties"].values():
        _limit_items(part)
    return whole


def _limit_items(part: dict[str, Any]) -> None:
    """Rename the limits of a list's length, which pydantic calls those of a text where a function
    reads the list first."""
    if part.get("type") == "array":
        for end in ("min", "max"):
            if f"{end}Length" in part:
                part[f"{end}Items"] = part.pop(f"{end}Length")
    for inner in (part.get("items"), *part.get("anyOf", ())):
        if isinstance(inner, dict):
            _limit_items(inner)


def field_docs(cls: type) -> dict[str, str]:
    """Return the docstring under each field of a class and its bases, on one line, without markup
    and full stop."""
    docs: dict[str, str] = {}
    for name, text in docstrings(cls).items():
        text = text.replace("``", "").removesuffix(".")
        word = text[1:2].islower() or text[:2] == "A "  # no symbol, such as T_r
        docs[name] = text[:1].lower() + text[1:] if word else text
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


def json_of(value: Any) -> str:
    """Return a definition, or a list of them, as JSON with the keys and units of files."""
    cls: Any = Any if isinstance(value, list) else type(value)
    return adapter(cls).dump_json(value, indent=2, by_alias=True).decode()


__all__ = [
    "Fault",
    "InputError",
    "adapter",
    "definition",
    "fault",
    "json_of",
    "read_as",
    "refuse",
]
