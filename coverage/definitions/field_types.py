"""Types of fields, with their limits: lengths, points and the like."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, GetPydanticSchema
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import core_schema

T = TypeVar("T")
FARTHEST = 100.0  # m, largest distance from the base
LONGEST_NAME = 100  # characters


def as_python(value: Any) -> Any:
    """Return a scalar of NumPy's as one of Python's, and anything else as it is."""
    return value.item() if isinstance(value, np.generic) else value


def as_tuple(values: Any) -> Any:
    """Return a list, an array or other items as a tuple, and anything else as it is."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if isinstance(values, Iterable) and not isinstance(values, str | bytes | dict | tuple):
        values = tuple(values)
    return tuple(map(as_python, values)) if isinstance(values, tuple) else values


def _unchecked(*_: Any) -> Any:
    from pydantic_core.core_schema import any_schema

    return any_schema()


def as_several(values: Any) -> Any:
    """Return one item, or any number of them, as a tuple; a table of a file is no list of one."""
    many = isinstance(values, Iterable) and not isinstance(values, str | bytes)
    return as_tuple(values) if many else (values,)


@dataclass(frozen=True)
class Made:
    """Annotation of an object that is made in Python: its class states no table of a file."""

    allowed: str
    """What may be passed, for messages."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return core_schema.is_instance_schema(source)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        return {"type": "made", "description": self.allowed}


Items = Annotated[tuple[T, ...], BeforeValidator(as_tuple)]
"""Any number of items; a list or an array becomes a tuple."""
Pair = Annotated[tuple[T, T], BeforeValidator(as_tuple)]
Triple = Annotated[tuple[T, T, T], BeforeValidator(as_tuple)]
InPython = Annotated[T, GetPydanticSchema(_unchecked), SkipJsonSchema(), Field(exclude=True)]
"""A value of a record that files do not state."""
Several = Annotated[tuple[T, ...], BeforeValidator(as_several)]
"""One item or any number of them, as a tuple."""
Text = Annotated[str, Field(max_length=LONGEST_NAME)]
PartNames = Annotated[Items[Text], Field(max_length=100)]
Metres = Annotated[float, Field(gt=0, le=100, description="length, m")]
Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="coordinate, m")]
Point = Triple[Coordinate]
Angles = Triple[Annotated[float, Field(ge=-360, le=360, description="angle, degrees")]]
ORIGIN = (0.0, 0.0, 0.0)
