"""Checks of single arguments: each refuses a wrong one in one line, with what is allowed."""

import math
from numbers import Integral, Real
from typing import Any

from ._errors import InputError


def whole(name: str, value: Any, least: int, most: float = math.inf) -> None:
    """Refuse what is no integer from ``least`` to ``most``: InputError."""
    allowed = f"{least} and more" if most == math.inf else f"{least} to {most:g}"
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise InputError(f"found {value!r}, allowed: an integer, {allowed}", name)
    if not least <= int(value) <= most:
        raise InputError(f"found {value}, allowed: {allowed}", name)


def number(name: str, value: Any, allowed: str = "a number") -> None:
    """Refuse what is no real number: InputError."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"found {value!r}, allowed: {allowed}", name)
