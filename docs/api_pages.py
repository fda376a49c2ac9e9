"""Markdown sections of the public API, from the signatures and docstrings in the source."""

import inspect
import math
import re
import textwrap
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import is_dataclass
from enum import Enum
from functools import cached_property, reduce
from types import NoneType, UnionType
from typing import Annotated, Any, ForwardRef, Literal, Union, get_args, get_origin, get_type_hints

import place_rings as pr
from place_rings.coverage.definitions.docstrings import docstrings
from place_rings.coverage.definitions.units import FileUnit, Key

_SECTION = re.compile(r"^(Args|Returns|Raises|Example|Examples|Yields):\s*$", re.MULTILINE)
_ITEM = re.compile(r"^([\w, *]+): ", re.MULTILINE)
_RESULTS = ("Coverage", "Improvement", "Proposal", "Report")  # functions return them
_LONGEST = 8  # characters of a number that is no angle
_WIDTH = 88  # characters of a signature on one line
_PLAIN = {
    r" \| ResolvedSetup\b": "",
    r"\bndarray": "np.ndarray",
    r"(?<![\w.])(?:jaxlib\._jax\.)?Array\b": "jax.Array",  # as versions of Python name it
}
_BY_NAME = inspect.Parameter.KEYWORD_ONLY
_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
_REPEATED = 6  # items that a class shares with one before it, from which on they are not repeated


def sections(names: str) -> str:
    """Return the sections of public names."""
    shown: dict[str, str] = {}
    return "\n\n".join("\n\n".join(_section(name, shown)) for name in names.split())


def _section(name: str, shown: dict[str, str]) -> Iterator[str]:
    """Yield the parts of a section; ``shown`` has the class of each item so far."""
    value = getattr(pr, name)
    yield f"### {name}"
    if inspect.isclass(value):
        yield from _class(name, value, shown)
    elif inspect.isfunction(value):
        yield from (_signature(f"pr.{name}", value), *_docstring(value))
    else:  # a catalogue
        yield from (*_docstring(type(value)), *_methods(type(value)))


def _class(name: str, value: type, shown: dict[str, str]) -> Iterator[str]:
    if not (issubclass(value, Exception | Enum) or name.endswith(_RESULTS)):
        yield _signature(f"pr.{name}", value)
    yield from _docstring(value)
    if issubclass(value, Enum):
        yield "\n".join(f"- `{one.name}`: {one.value}" for one in value)
        return
    hints, texts = get_type_hints(value, include_extras=True), docstrings(value)
    items = {
        key: f"- `{key}`{_limits(hints[key])}: {_plain(texts[key])}"
        for key in inspect.signature(value).parameters
        if key in texts
    } | {key: f"- `{key}`: {_flat(text)}" for key, text in _properties(value)}
    first = {key: shown.setdefault(item, name) for key, item in items.items()}
    repeated = [key for key in items if first[key] != name]
    if len(repeated) >= _REPEATED:
        items = {key: item for key, item in items.items() if key not in repeated}
        others = ", ".join(f"`{key}`" for key in repeated)
        items[""] = f"- as those of `{first[repeated[0]]}`: {others}"
    if items:
        yield "\n".join(items.values())
    yield from _methods(value)


def _limits(hint: Any) -> str:
    """Return the limits in an annotation, in Python's unit; those of angles in degrees."""
    for meta in getattr(hint, "__metadata__", ()):
        unit = meta if isinstance(meta, FileUnit) else Key("")
        parts = getattr(meta, "metadata", ())
        ends = unit.limits | {k: getattr(p, k) for p in parts for k in _SIGNS if hasattr(p, k)}
        angle = unit.from_file is math.radians
        if ends:
            values = {k: v if angle else unit.from_file(v) for k, v in ends.items()}
            limits = (f"{_SIGNS[key]} {v:g}{'°' * angle}" for key, v in values.items())
            return f" ({', '.join(limits)})".replace("e+0", "e")
    return next(filter(None, map(_limits, get_args(hint))), "")


def _properties(value: type) -> list[tuple[str, str]]:
    """Return names and docstrings of the public properties that are not deprecated."""
    found = {}
    for base in reversed(value.__mro__):
        for key, one in list(vars(base).items()):
            get = getattr(one, "fget", None) or getattr(one, "func", None)
            if (
                not key.startswith("_")
                and isinstance(one, property | cached_property)
                and "DeprecationWarning" not in inspect.getsource(get)
            ):
                found[key] = inspect.getdoc(one) or ""
    return [(key, text) for key, text in found.items() if text]


def _methods(value: type) -> Iterator[str]:
    """Yield the parts of each public method that the class itself defines with a docstring."""
    for key, one in list(vars(value).items()):  # the loop may fill a cache of the class
        plain = getattr(one, "__func__", one)  # of a class method or a static method
        if not key.startswith("_") and inspect.isfunction(plain) and plain.__doc__:
            yield _signature(f"{value.__name__}.{key}", plain)
            yield from _docstring(plain)


def _docstring(value: Any) -> Iterator[str]:
    """Yield the parts of a docstring as Markdown."""
    text = inspect.cleandoc(value.__doc__ or "")
    pieces = _SECTION.split(text)
    yield _plain(pieces[0])
    for title, body in zip(pieces[1::2], pieces[2::2], strict=True):
        body = textwrap.dedent(body.strip("\n")).strip()
        if title.startswith("Example"):
            yield f"```pycon\n{body}\n```"
        elif title == "Args":
            yield "\n".join(f"- {line}" for line in _items(body))
        elif title == "Raises":
            yield "Raises " + "; ".join(_items(body))
        else:
            yield f"{title} {_flat(body[0].lower() + body[1:] if body[1:2].islower() else body)}"


def _items(body: str) -> list[str]:
    """Return ``name: text`` items, each on one line, with the name as code."""
    items = re.split(r"\n(?=\S)", body)
    return [_ITEM.sub(lambda m: f"`{m[1]}`: ", _flat(item), count=1) for item in items]


def _type(kind: Any) -> str:
    """Return a type as a person writes it, without the limits of ``Annotated``."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _type(inner[0])
    if origin in (Union, UnionType):
        return " | ".join(map(_type, inner))
    if isinstance(kind, list) or origin:
        within = ", ".join(map(repr if origin is Literal else _type, inner or kind))
        return f"{origin.__name__ if origin else ''}[{within}]"
    if kind in (None, NoneType, ...):
        return "..." if kind is ... else "None"
    if isinstance(kind, ForwardRef):
        return kind.__forward_arg__
    return kind if isinstance(kind, str) else kind.__name__


def _value(value: Any) -> str:
    """Return a default in Python's terms."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_value, value))}{',' * (len(value) == 1)})"
    if isinstance(value, float) and len(repr(value)) > _LONGEST:
        return f"math.radians({round(math.degrees(value), 9):g})"
    if isinstance(value, pr.Robot | pr.Pose):
        return f"robots[{value.name!r}]" if isinstance(value, pr.Robot) else "Pose(...)"
    with suppress(TypeError, ValueError):  # one with required arguments
        if is_dataclass(value) and value == type(value)():
            return f"{type(value).__name__}()"
    return repr(value)


def _signature(name: str, function: Any) -> str:
    """Return a fence with the signature of a function or method."""
    signature = inspect.signature(function)
    parameters = list(signature.parameters.values())
    if parameters and parameters[0].name in ("self", "cls"):
        parameters = parameters[1:]
    returns = signature.return_annotation
    plain = returns in (None, inspect.Signature.empty)
    return _call(name, parameters, "" if plain else f" -> {_type(returns)}")


def _call(name: str, parameters: list[inspect.Parameter], arrow: str) -> str:
    given, by_name = [], False
    for parameter in parameters:
        if parameter.kind is _BY_NAME and not by_name:
            given.append("*")
        by_name = parameter.kind in (_BY_NAME, parameter.VAR_POSITIONAL)
        stars = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        kind = "" if parameter.annotation is parameter.empty else f": {_type(parameter.annotation)}"
        default = "" if parameter.default is parameter.empty else f" = {_value(parameter.default)}"
        given.append(f"{stars}{parameter.name}{kind}{default}")
    *given, arrow = (reduce(lambda t, p: re.sub(*p, t), _PLAIN.items(), t) for t in (*given, arrow))
    line = f"{name}({', '.join(given)}){arrow}"
    if len(line) > _WIDTH:
        line = f"{name}(\n" + "".join(f"    {one},\n" for one in given) + f"){arrow}"
    return f"```pyi\n{line}\n```"


def _flat(text: str) -> str:
    return _plain(" ".join(text.split()))


def _plain(text: str) -> str:
    """Return text with code in single backticks."""
    return text.replace("``", "`").strip()
