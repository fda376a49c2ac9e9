"""Options of a computation: fields whose annotations state their limits, for Python and the
command, which checks nothing itself.

This module loads nothing that takes time, so that the command's help comes at once.
"""

import math
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Annotated, Any, Literal, get_args, get_origin

from .errors import InputError, shown


@dataclass(frozen=True)
class Whole:
    """Limits of an integer."""

    least: int
    """The smallest."""
    most: float = math.inf
    """The largest."""

    @property
    def allowed(self) -> str:
        """The limits as text."""
        return f"{self.least} " + ("or more" if self.most == math.inf else f"to {self.most:g}")

    def check(self, name: str, value: Any) -> None:
        """Raise InputError for anything but an integer within the limits."""
        if isinstance(value, bool) or not isinstance(value, Integral):
            raise InputError(f"found {value!r}, allowed: an integer, {self.allowed}", name)
        if not self.least <= int(value) <= self.most:
            raise InputError(f"found {value}, allowed: {self.allowed}", name)


@dataclass(frozen=True)
class Number:
    """Limits of a number, as text and as values."""

    allowed: str
    gt: float = -math.inf
    ge: float = -math.inf
    lt: float = math.inf
    le: float = math.inf

    def check(self, name: str, value: Any) -> None:
        """Raise InputError for anything but a number within the limits."""
        if isinstance(value, bool) or not isinstance(value, Real):
            raise InputError(f"found {value!r}, allowed: {self.allowed}", name)
        try:
            number = float(value)
        except OverflowError:  # an integer beyond all floats
            raise InputError(f"found {shown(value)}, allowed: {self.allowed}", name) from None
        if not (self.gt < number < self.lt and self.ge <= number <= self.le):
            raise InputError(f"found {number:g}, allowed: {self.allowed}", name)


Seed = Annotated[int, Whole(0)]
Seconds = Annotated[float | None, Number("a positive number of seconds", gt=0)]
Voxel = Annotated[float, Number("m, above 0", gt=0)]
Draws = Annotated[int, Whole(1, 100_000)]


class Options:
    """Options that check themselves by the limits and choices in their annotations."""

    def __post_init__(self) -> None:
        for option in fields(self):  # type: ignore[arg-type]
            name, value = option.name, getattr(self, option.name)
            kind, limits = kind_of(option.type)
            for limit in limits if value is not None else ():
                limit.check(name, value)
            literal = (k for k in (kind, *get_args(kind)) if get_origin(k) is Literal)
            choices = [None, *get_args(next(literal, None))]
            if len(choices) > 1 and value not in choices:
                raise InputError(f"found {value!r}, allowed: {', '.join(choices[1:])}", name)


def kind_of(annotation: Any) -> tuple[Any, list[Any]]:
    """Return the type of an option, and the limits that its annotation states."""
    kind, *limits = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
    return kind, limits
