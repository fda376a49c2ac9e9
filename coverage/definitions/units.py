"""Units of numbers in files, where they differ from those in Python: annotations of fields.

``Annotated[float, Degrees("tilt_deg", gt=-90, lt=90)]`` is an angle in rad, for which files have
the key ``tilt_deg``. The limits are those in files; Python's value is held to them as well.
"""

import dataclasses
import math
import re
from collections.abc import Callable, Iterator
from inspect import get_annotations
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from pydantic import Field
from pydantic_core import core_schema

from .errors import InFile
from .options import Number, Whole

C = TypeVar("C")
DIGITS = 9  # decimals of a value in files whose unit differs from Python's


@dataclasses.dataclass(frozen=True, eq=False)
class FileUnit:
    """Annotation of a number that files state in another unit, and under the key ``key``."""

    key: str
    """Key in files, such as ``tilt_deg``; empty for the field's own name."""
    from_file: Callable[[Any], float]
    """From the unit of files to Python's."""
    to_file: Callable[[Any], float]
    """From Python's unit to that of files."""
    limits: dict[str, float]
    """Limits in files: ``gt``, ``ge``, ``lt``, ``le``."""
    python: Number | Whole | None = None
    """Limits in Python, where they are wider."""

    def wider(self, python: Number | Whole) -> "FileUnit":
        """Return the unit with wider limits in Python, as of what was measured."""
        return dataclasses.replace(self, python=python)

    @property
    def converts(self) -> bool:
        """Whether files have another unit than Python, not only another key."""
        return self.to_file(0.5) != 0.5

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        def read(value: Any, checked: Any) -> Any:
            if isinstance(value, InFile):
                return self.from_file(checked(value.value))
            if isinstance(value, bool) or not isinstance(value, int | float):
                return checked(value)  # raises
            if self.python is not None:
                self.python.check("", value)
                return value
            try:
                checked(self.to_file(value))
            except OverflowError:  # an integer beyond all floats
                checked(math.inf if value > 0 else -math.inf)  # raises
            return value if source is int else float(value)

        return core_schema.no_info_wrap_validator_function(
            read,
            self._number(source),
            serialization=core_schema.plain_serializer_function_ser_schema(self.to_file),
        )

    def _number(self, source: Any) -> Any:
        limits: Any = self.limits
        if source is int:
            return core_schema.int_schema(strict=True, **limits)
        return core_schema.float_schema(strict=True, allow_inf_nan=False, **limits)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        return handler(schema["schema"])


def degrees(angle: float) -> float:
    """Return an angle in degrees as files state it, without residues of rounding."""
    return round(math.degrees(angle), DIGITS)


def Key(key: str, **limits: float) -> FileUnit:
    """Return the annotation of a number that files state under another key, in the same unit."""
    return FileUnit(key, _same, _same, limits)


def _same(value: float) -> float:
    return value


def Within(**limits: float) -> FileUnit:
    """Return the annotation of a number that files state as it is, within limits."""
    return Key("", **limits)


def Degrees(
    key: str = "", *, write: Callable[[float], float] = degrees, **limits: float
) -> FileUnit:
    """Return the annotation of an angle in rad that files state in degrees."""
    return FileUnit(key, math.radians, write, limits)


def Percent(key: str = "", **limits: float) -> FileUnit:
    """Return the annotation of a share that files state in percent."""
    limits = {"ge": 0, "le": 100} | limits
    return FileUnit(key, lambda value: value / 100, lambda x: round(100 * x, DIGITS), limits)


def Covered(key: str) -> FileUnit:
    """Return the annotation of a computed share in [0, 1] that files state in percent; rounding
    errors may carry it beyond."""
    limits: dict[str, float] = {"ge": 0, "le": 100}
    return FileUnit(
        key, lambda value: value / 100, lambda x: min(max(100 * float(x), 0.0), 100.0), limits
    )


def Points(key: str, digits: int) -> FileUnit:
    """Return the annotation of a difference of shares that files state in percentage points."""
    return FileUnit(key, lambda value: value / 100, lambda x: round(100 * x, digits), {})


def Millimetres(key: str = "", digits: int = 6, **limits: float) -> FileUnit:
    """Return the annotation of a length in m that files state in mm."""
    return FileUnit(key, lambda mm: mm / 1000, lambda x: round(1000 * x, digits), limits)


def Decimals(digits: int, key: str = "", **limits: float) -> FileUnit:
    """Return the annotation of a number that files state with ``digits`` decimals; -0 as 0."""
    return FileUnit(key, float, lambda value: round(float(value), digits) + 0.0, limits)


_UNITS = {
    "deg": (r", rad\b", ", degrees"),
    "mm": (r", m\b", ", mm"),
    "percent": (r"^[^;:]*", r"\g<0>, percent"),
    "points": (r"^[^;:]*", r"\g<0>, percentage points"),
}


def text_in_file(key: str, text: str) -> str:
    """Return a field's line of help with the unit in which files state it, which ``key`` names."""
    for name, (python, file) in _UNITS.items():
        if f"_{name}" in key and file.split()[-1] not in text:
            text = re.sub(python, file, text)
    return text


class _OfScene:
    def __reduce__(self) -> str:
        return "OF_SCENE"  # one object, in copies too

    def __format__(self, _: str) -> str:
        return "OF_SCENE"

    __repr__ = __reduce__


OF_SCENE: Any = _OfScene()
"""The value of a field for which a file leaves the choice to the scene."""


@dataclasses.dataclass(frozen=True, eq=False)
class Absent:
    """Annotation of a field without a default in Python, or with another one: its value where a
    file does not state its key."""

    value: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        inner = handler(source)
        if self.value is not OF_SCENE:
            return inner
        return core_schema.no_info_wrap_validator_function(
            lambda value, checked: value if value is OF_SCENE else checked(value),
            inner,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda value, written: None if value is OF_SCENE else written(value), schema=inner
            ),
        )

    def in_schema(self, part: dict[str, Any]) -> dict[str, Any]:
        """Return the JSON Schema of the key, which may be absent."""
        if self.value is not OF_SCENE:
            return part | {"default": self.value}
        kind = {key: v for key, v in part.items() if key not in ("default", "description")}
        kinds = kind if "anyOf" in kind else {"anyOf": [kind, {"type": "null"}]}
        return kinds | {"default": None, "description": part.get("description", "")}


def absent_in(cls: type) -> dict[str, Absent]:
    """Return the annotation of each field whose key may be absent, by name."""
    hints = get_type_hints(cls, include_extras=True)
    metas = ((name, getattr(hint, "__metadata__", ())) for name, hint in hints.items())
    return {name: meta for name, group in metas for meta in group if isinstance(meta, Absent)}


INLINE = "in line"
"""Annotation of a field whose own keys stand in a file among those of the table."""


ELSEWHERE = Field(exclude=True)
"""Annotation of a field that the table of its class in a file does not state."""


def inline_in(cls: type) -> dict[str, Any]:
    """Return the definitions of the fields of a class that are ``INLINE``."""
    hints = get_type_hints(cls, include_extras=True).items()
    return {
        name: get_args(get_args(hint)[0])[0]
        for name, hint in ((name, getattr(hint, "type", hint)) for name, hint in hints)
        if get_origin(hint) is Annotated and INLINE in hint.__metadata__
    }


def units_of(annotation: Any) -> Iterator[FileUnit]:
    """Yield the units in an annotation: of the value, of its items, or of one of its kinds."""
    if get_origin(annotation) is Annotated:
        yield from (meta for meta in annotation.__metadata__ if isinstance(meta, FileUnit))
    for inner in get_args(annotation):
        yield from units_of(inner)


def units_in(cls: type) -> dict[str, FileUnit]:
    """Return the unit of each field with one, of the class and its bases."""
    hints = get_type_hints(cls, include_extras=True)
    units = {name: next(units_of(hint), None) for name, hint in hints.items()}
    return {name: unit for name, unit in units.items() if unit is not None}


def as_in_file(value: C) -> C:
    """Return a definition with its numbers as they read back from a file."""
    numbers = ((name, unit, getattr(value, name)) for name, unit in units_in(type(value)).items())
    read = {name: unit.from_file(unit.to_file(v)) for name, unit, v in numbers if v is not None}
    return dataclasses.replace(value, **read)  # type: ignore[type-var]


def with_keys(cls: type) -> dict[str, str]:
    """State the keys of a class's fields with units as their aliases, for pydantic, and return the
    key of each field with a unit, of the class and its bases."""
    units, own = units_in(cls), get_annotations(cls)
    for name, unit in units.items():
        if unit.key and name in own:
            own[name] = Annotated[own[name], Field(alias=unit.key)]
    cls.__annotations__ = own  # from Python 3.14 on the class has no dictionary of its own before
    return {name: unit.key or name for name, unit in units.items()}


def in_file(value: Any) -> Any:
    """Return a value of a file with its numbers marked as in the unit of files."""
    match value:
        case bool():
            return value
        case int() | float():
            return InFile(value)
        case list() | tuple():
            return [in_file(item) for item in value]
        case dict():
            return {key: in_file(item) for key, item in value.items()}
    return value
