"""Mapping between a table in a file and the domain object that it describes.

Each key of a ``MappedModel`` corresponds to the domain field of the same name and value. Where the
name or the unit differs, the key's annotation states it once, for both directions::

    class MotionModel(MappedModel[Motion]):
        speed_deg_s: Annotated[float, Of("speed", DEGREES)] = 15.0

A list is a tuple in the domain, a table the domain object of its own model. Keys that correspond to
no single field are passed by name to ``to_domain`` and ``from_domain``.
"""

import dataclasses
import math
from collections.abc import Callable
from functools import cache
from typing import Any, Generic, Self, TypeVar, get_args

import numpy as np

from ...coverage.definitions.units import degrees
from .base_model import StrictModel

D = TypeVar("D")
_DIGITS = 9  # decimals of a value whose unit differs from the domain's


@dataclasses.dataclass(frozen=True)
class Unit:
    """Conversion of a number between file and domain."""

    read: Callable[[Any], Any]
    """From the file to the domain."""
    write: Callable[[Any], Any]
    """From the domain to the file."""


def _as_it_is(value: Any) -> Any:
    return value


def decimals(digits: int) -> Unit:
    """Return the domain's own unit, written with ``digits`` decimals; -0.0 is written as 0.0."""
    return Unit(_as_it_is, lambda value: round(float(value), digits) + 0.0)


def rounded_degrees(digits: int) -> Unit:
    """Return degrees for the domain's radians, written with ``digits`` decimals."""
    return Unit(math.radians, lambda angle: round(math.degrees(angle), digits) + 0.0)


def rounded_millimetres(digits: int) -> Unit:
    """Return millimetres for the domain's metres, written with ``digits`` decimals."""
    return Unit(lambda length: length / 1000, lambda length: round(1000 * length, digits))


SAME = Unit(_as_it_is, _as_it_is)
DEGREES = Unit(math.radians, degrees)
PERCENT = Unit(lambda percent: percent / 100, lambda share: round(100 * share, _DIGITS))
COVERAGE = Unit(
    lambda percent: percent / 100, lambda share: min(max(100 * float(share), 0.0), 100.0)
)
"""Percentage of a computed share in [0, 1], which rounding errors may carry beyond."""


@dataclasses.dataclass(frozen=True)
class Of:
    """The domain's side of a key."""

    field: str = ""
    """Name of the domain's field; empty: the key's own."""
    unit: Unit = SAME
    """Unit of each number in the value."""
    array: bool = False
    """Whether the domain holds a list as a NumPy array instead of a tuple."""
    table: "type[MappedModel[Any]] | None" = None
    """Model of the tables in the value, if they are mapped themselves; set automatically."""

    def read(self, value: Any) -> Any:
        """Return the domain's value for the value of a key."""
        match value:
            case None:
                return None
            case MappedModel():
                return value.to_domain()
            case dict():
                return {key: self.read(inner) for key, inner in value.items()}
            case list():
                values = [self.read(inner) for inner in value]
                return np.array(values, float) if self.array else tuple(values)
            case _:
                return self.unit.read(value)

    def write(self, value: Any) -> Any:
        """Return the value of a key for the value of a field."""
        match value:
            case None:
                return None
            case dict():
                return {key: self.write(inner) for key, inner in value.items()}
            case np.ndarray():
                return self.write(value.tolist())
            case tuple() | list():
                return [self.write(inner) for inner in value]
            case _:
                return (
                    self.unit.write(value) if self.table is None else self.table.from_domain(value)
                )


class MappedModel(StrictModel, Generic[D]):
    """A table in a file that describes a domain object of the dataclass ``D``."""

    def to_domain(self, **given: Any) -> D:
        """Return the domain object; ``given`` holds fields that no single key states."""
        domain, sides = _mapping(type(self))
        fields = {field.name for field in dataclasses.fields(domain)} - set(given)
        stated = {
            side.field: side.read(getattr(self, key))
            for key, side in sides.items()
            if side.field in fields
        }
        value: D = domain(**stated, **given)
        return value

    @classmethod
    def from_domain(cls, value: D, **given: Any) -> Self:
        """Return the table that describes ``value``; ``given`` holds keys that no single field
        states."""
        stated = {
            key: side.write(getattr(value, side.field))
            for key, side in _mapping(cls)[1].items()
            if key not in given and hasattr(value, side.field)
        }
        return cls(**stated, **given)


def domain_field(model: type[MappedModel[Any]], key: str) -> str:
    """Return the name of the domain's field for a key; the key's own where its unit alone
    differs and the domain has no single field for it."""
    field = _mapping(model)[1][key].field
    return field.removesuffix("_deg")


@cache
def _mapping(model: type[MappedModel[Any]]) -> tuple[type, dict[str, Of]]:
    """Return the dataclass that a model describes, and the domain's side of each key."""
    bases = (base for base in model.__mro__ if issubclass(base, MappedModel))
    domain = next(args[0] for base in bases if (args := base.__pydantic_generic_metadata__["args"]))
    known = {field.name for field in dataclasses.fields(domain)}
    sides = {}
    for key, info in model.model_fields.items():
        side = next((meta for meta in info.metadata if isinstance(meta, Of)), Of())
        if side.field and side.field not in known and not hasattr(domain, side.field):
            raise TypeError(f"{model.__name__}.{key}: {domain.__name__} has no {side.field}")
        table = _table_in(info.annotation)
        sides[key] = dataclasses.replace(side, field=side.field or key, table=table)
    return domain, sides


def _table_in(annotation: Any) -> type[MappedModel[Any]] | None:
    """Return the mapped model in an annotation: alone, as an option, or in a list."""
    if isinstance(annotation, type) and issubclass(annotation, MappedModel):
        return annotation
    return next(filter(None, map(_table_in, get_args(annotation))), None)
