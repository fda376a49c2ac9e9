"""Errors for the user: one line with the file, the key, the value found and the values allowed."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import TYPE_CHECKING, Any

from ..angles import radians_hint
from .escaping import printable

if TYPE_CHECKING:  # keeps pydantic out of the start-up
    from pydantic import ValidationError

NAMED, IN_LINE = "by name", "in-line"  # tags of a key's two kinds, omitted from its name
_LONGEST = 60  # characters of a text that a message shows


@dataclass(frozen=True)
class InFile:
    """A number of a file, in the unit of files."""

    value: Any


class UserError(Exception):
    """Raised for unusable input. The message is one printable line; the caller prints it and exits
    with code 2."""

    def __init__(self, line: str) -> None:
        super().__init__(printable(line))


def unusable(where: str, found: object, allowed: str) -> UserError:
    """Return the error for a value: file and key, what is there, and what may be."""
    return UserError(f"{where}: found {shown(found)}, allowed: {allowed}")


class InputError(UserError, ValueError):
    """An argument is invalid, or a file that it names cannot be used.

    The message has one line, which states the received value and the allowed ones.

    Example:
        >>> import place_rings as pr
        >>> try:
        ...     pr.Scene(robot="ur9")
        ... except pr.InputError as error:
        ...     print(str(error)[:25])
        Scene: robot: found "ur9"
    """

    def __init__(
        self, line: str, argument: str = "", value: object = "", others: tuple[str, ...] = ()
    ) -> None:
        self.argument = argument
        """Name of the argument, empty for an error in a file; a command writes it ``--name``."""
        self.line = line
        """The message without that name."""
        self._value, self._others = value, others
        super().__init__(self.written(lambda name: name))

    def written(self, write: Callable[[str], str]) -> str:
        """Return the message with the names of arguments as ``write`` spells them.

        The message begins with ``argument`` and the offending part of its value, if there is one.
        ``others`` are the names of further arguments in the line, matched as whole words.
        """
        line, others = self.line, "|".join(self._others)
        if others:  # all at once: one name may occur in the option of another
            line = re.sub(rf"\b(?:{others})\b", lambda found: write(found[0]), line)
        if not self.argument:
            return printable(line)
        part = f" {self._value}" if self._value else ""
        return printable(f"{write(self.argument)}{part}: {line}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.line, self.argument, self._value, self._others)


@contextmanager
def input_errors(argument: str = "", *, but: tuple[type[ValueError], ...] = ()) -> Iterator[None]:
    """Convert errors of files and values in this context to InputError.

    Args:
        argument: name of the argument that an error of a value is attributed to.
        but: types of errors that pass unchanged.
    """
    try:
        yield
    except InputError:
        raise
    except UserError as error:
        raise InputError(str(error)) from error
    except ValueError as error:
        if isinstance(error, but):
            raise
        raise InputError(str(error), argument) from error


def shown(value: Any) -> str:
    """Return a value as a message shows it: short, on one line, in TOML notation."""
    match value:
        case InFile(number):
            return shown(number)
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
        case int() if value.bit_length() > 64:
            return f"an integer of {value.bit_length()} bits"
        case int() | float():
            return str(value)
        case str():
            text = value if len(value) <= _LONGEST else value[:_LONGEST] + "…"
            return '"' + text.replace('"', '\\"') + '"'
        case Mapping():
            return "a table"
        case list() | tuple():
            return f"a list of {len(value)}"
        case _ if hasattr(value, "shape"):
            return f"an array of shape {value.shape}"
        case _:
            return f"a {type(value).__name__}"


@cache
def schema_of(model: Any) -> dict[str, Any]:
    """Return the JSON Schema of a model or definition, made once: change no part of it."""
    from pydantic import TypeAdapter
    from pydantic.json_schema import GenerateJsonSchema

    quiet = {"ignored_warning_kinds": {"skipped-choice", "non-serializable-default"}}
    generator: Any = type("Quiet", (GenerateJsonSchema,), quiet)
    return TypeAdapter(model).json_schema(schema_generator=generator)


def explain(file: str, error: "ValidationError", model: Any) -> UserError:
    """Return the first error of ``error`` about ``file`` as one line, with the number of further
    errors.

    The allowed values come from the JSON Schema of ``model``, a model or definition, so that limits
    are stated once. A rule that a schema cannot express (pydantic's error type "rule") has its own
    text.
    """
    faults = error.errors(include_url=False)
    where, text = key_path(_place(faults[0])), _line(faults[0], schema_of(model))
    places = {_place(fault) for fault in faults}  # each missing item of a list is a fault of it
    more = f" (and {len(places) - 1} more)" if len(places) > 1 else ""
    return UserError(f"{file}: {where + ': ' if where else ''}{text}{more}")


def explained(
    error: "ValidationError", schema: Mapping[str, Any]
) -> list[tuple[tuple[int | str, ...], str]]:
    """Return the place of each error, and what was found and is allowed there."""
    faults = error.errors(include_url=False)
    return [(_place(fault), _line(fault, schema)) for fault in faults]


def explain_argument(error: "ValidationError", definition: type) -> InputError:
    """Return the first error of the arguments of a definition, with the names of its fields."""
    fault = error.errors(include_url=False)[0]
    fields: Any = definition.__pydantic_fields__  # type: ignore[attr-defined]
    loc = _place(fault)
    if loc and isinstance(loc[0], int):  # by position
        names: tuple[str, ...] = definition.__match_args__  # type: ignore[attr-defined]
        if loc[0] >= len(names):
            allowed = f"at most {len(names)} by position" if names else "only those by name"
            line = f"found {shown(fault['input'])}, allowed: {allowed}"
            return InputError(line, f"{definition.__name__}: arguments")
        loc = (names[loc[0]], *loc[1:])
    keys = {name: f.alias or name for name, f in fields.items() if not f.init_var}
    own = {key: name for name, key in keys.items()}
    path = [own.get(str(part), part) if i == 0 else part for i, part in enumerate(loc)]
    if fault["type"] == "unexpected_keyword_argument":
        line = f"found an unknown argument, allowed: {', '.join(keys)}"
        return InputError(line, f"{definition.__name__}: {loc[0]}")
    schema = schema_of(definition)
    named = {own.get(key, key): node for key, node in schema.get("properties", {}).items()}
    line = _line({**fault, "loc": tuple(path)}, {**schema, "properties": named})
    if fault["type"].startswith("dataclass"):
        line = f"found {shown(fault['input'])}, allowed: a {fault['ctx']['class_name']}"
    if path and str(path[0]) not in own and "_deg" in keys.get(str(path[0]), ""):
        wide = fault["type"] == "value_error"  # by limits in rad
        hint = radians_hint(fault["input"]) if wide else _hint(fault)
        line = f"{'' if wide else 'in degrees, '}{line}{hint}"
    if any("_deg" in str(part) for part in path):
        path = [str(part).removesuffix("_deg") if isinstance(part, str) else part for part in path]
        line = f"in degrees, {line}{_hint(fault)}"
    return InputError(line, f"{definition.__name__}: {key_path(tuple(path))}".removesuffix(": "))


def _hint(fault: Mapping[str, Any]) -> str:
    """Return what would state the angle that was given in degrees in place of radians, or ""."""
    value = fault.get("ctx", {}).get("found", fault.get("input"))
    try:
        return radians_hint(round(math.radians(float(value)), 6))
    except (TypeError, ValueError):
        return ""


def _place(fault: Mapping[str, Any]) -> tuple[int | str, ...]:
    """Return the place of an error: of a list that is too short, not that of its missing item."""
    loc: tuple[int | str, ...] = fault["loc"]
    short = fault["type"] == "missing" and len(loc) > 1 and isinstance(loc[-1], int)
    return loc[:-1] if short else loc


def _line(fault: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """Return what was found at fault, and what is allowed there."""
    loc, kind = _place(fault), fault["type"]
    unknown = kind in ("extra_forbidden", "unexpected_keyword_argument")
    node, rest = _descend(schema, loc[:-1] if unknown else loc)
    if kind == "rule":
        text: str = fault["msg"]
        return text
    if unknown:
        keys = list(node.get("properties", rest))
        near = get_close_matches(str(loc[-1]), keys, n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        return f"found an unknown key{hint}, allowed: {', '.join(keys)}"
    if kind.startswith("missing") and loc == fault["loc"]:
        return f"missing; give {_allowed(node, schema)}"
    if kind == "value_error":  # of a rule between fields, which states both
        return str(fault["ctx"]["error"])
    return f"found {shown(fault['input'])}, allowed: {_allowed(node, schema)}"


def key_path(loc: tuple[int | str, ...]) -> str:
    """Return the path of a key, such as ``poses[0].q_deg``; a part that is no bare TOML key is
    quoted."""
    text = ""
    for part in loc:
        if part in (NAMED, IN_LINE):
            continue
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            bare = (
                part.replace("_", "").replace("-", "").isalnum()
                and part.isascii()
                and len(part) <= _LONGEST
            )
            text += "." * bool(text) + (part if bare else shown(part))
    return text


def _resolve(node: Mapping[str, Any], schema: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return ``node`` with its reference resolved, without the null option of an optional key."""
    for option in node.get("anyOf", ()):
        if option.get("type") != "null":
            node = {**option, **{key: node[key] for key in ("description",) if key in node}}
    if "$ref" in node:
        node = schema["$defs"][node["$ref"].rpartition("/")[2]]
    return node


def _descend(
    schema: Mapping[str, Any], loc: tuple[int | str, ...]
) -> tuple[Mapping[str, Any], tuple[int | str, ...]]:
    """Return the part of ``schema`` at a location, and the rest of the location where the schema
    ends."""
    node = _resolve(schema, schema)
    for i, part in enumerate(loc):
        inner: Any
        if part in (NAMED, IN_LINE):
            inner = next(n for n in node["oneOf"] if (n.get("type") == "string") == (part == NAMED))
        elif isinstance(part, int):
            pair = node.get("prefixItems", ())
            inner = pair[part] if part < len(pair) else node.get("items")
        else:
            inner = node.get("properties", {}).get(part, node.get("additionalProperties"))
        if not isinstance(inner, Mapping):
            return node, loc[i:]
        node = _resolve(inner, schema)
    return node, ()


def _allowed(node: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """Return the text for the values that a part of a JSON Schema allows."""
    if "enum" in node:
        return ", ".join(map(str, node["enum"]))
    if "oneOf" in node:
        return " or ".join(_allowed(_resolve(kind, schema), schema) for kind in node["oneOf"])
    if "const" in node:
        return str(node["const"])
    kind = node.get("type")
    if kind == "made":
        return str(node["description"])
    if kind == "object":
        return "a table" + (
            f" with keys among {', '.join(node['properties'])}" if "properties" in node else ""
        )
    if kind == "array":
        low, high = node.get("minItems", 0), node.get("maxItems")
        items = _resolve(node["items"] if "items" in node else node["prefixItems"][0], schema)
        size = f"{low}" if low == high else f"{low} or more" if high is None else f"{low} to {high}"
        if items.get("type") == "object":
            return f"a list of {size} table{'s' * (size != '1')}"
        return f"a list of {size}, each {_allowed(items, schema)}"
    kinds = {
        "number": "a number",
        "integer": "an integer",
        "string": "text",
        "boolean": "true or false",
        "function": "a function",
    }
    limits = [
        f"{word} {node[key]}"
        for key, word in (
            ("minimum", "at least"),
            ("exclusiveMinimum", "above"),
            ("maximum", "at most"),
            ("exclusiveMaximum", "below"),
            ("maxLength", "no longer than"),
        )
        if key in node
    ]
    unit = f" ({node['description']})" if "description" in node else ""
    low, high = node.get("minimum"), node.get("maximum")
    if low is not None and high is not None:
        if low == high:
            return f"the integer {low}{unit}"
        limits = [f"from {low} to {high}"]
    return f"{kinds.get(str(kind), 'another value')} {' and '.join(limits)}".rstrip() + unit
