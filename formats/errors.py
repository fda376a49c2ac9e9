"""Errors for the user: one line with the file, the key, the value found and the values allowed."""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from .escaping import printable

if TYPE_CHECKING:  # keeps pydantic out of the start-up
    from pydantic import BaseModel, ValidationError

NAMED, IN_LINE = "by name", "in-line"  # tags of a key's two kinds, omitted from its name
_LONGEST = 60  # characters of a text that a message shows


class UserError(Exception):
    """Raised for unusable input. The message is one printable line; the caller prints it and exits
    with code 2."""

    def __init__(self, line: str) -> None:
        super().__init__(printable(line))


def shown(value: Any) -> str:
    """Return a value as a message shows it: short, on one line, in TOML notation."""
    match value:
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
        case _:
            return f"a {type(value).__name__}"


def explain(file: str, error: "ValidationError", model: "type[BaseModel]") -> UserError:
    """Return the first error of ``error`` about ``file`` as one line, with the number of further
    errors.

    The allowed values come from the JSON Schema of ``model``, so that limits are stated once. A
    rule that a schema cannot express (pydantic's error type "rule") has its own text.
    """
    faults = error.errors(include_url=False)
    first, schema = faults[0], model.model_json_schema()
    where = key_path(first["loc"])
    node, rest = _descend(
        schema, first["loc"][:-1] if first["type"] == "extra_forbidden" else first["loc"]
    )
    if first["type"] == "rule":
        text = first["msg"]
    elif first["type"] == "extra_forbidden":
        keys = list(node.get("properties", rest))
        near = get_close_matches(str(first["loc"][-1]), keys, n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        text = f"found an unknown key{hint}, allowed: {', '.join(keys)}"
    elif first["type"] == "missing":
        text = f"missing; give {_allowed(node, schema)}"
    else:
        text = f"found {shown(first['input'])}, allowed: {_allowed(node, schema)}"
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return UserError(f"{file}: {where + ': ' if where else ''}{text}{more}")


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
        return ", ".join(node["enum"])
    if "const" in node:
        return str(node["const"])
    kind = node.get("type")
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
