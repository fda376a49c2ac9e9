"""Checks of single arguments; each error states the allowed values in one line."""

import math
from numbers import Integral, Real
from typing import Any

from ._errors import InputError


def whole(name: str, value: Any, least: int, most: float = math.inf) -> None:
    """Check that an argument is an integer in a range.

    Args:
        name: name of the argument, for the message.
        value: its value.
        least: smallest allowed value.
        most: largest allowed value.

    Raises:
        InputError: otherwise.
    """
    allowed = f"{least} or more" if most == math.inf else f"{least} to {most:g}"
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise InputError(f"found {value!r}, allowed: an integer, {allowed}", name)
    if not least <= int(value) <= most:
        raise InputError(f"found {value}, allowed: {allowed}", name)


def number(name: str, value: Any, allowed: str = "a number") -> None:
    """Check that an argument is a real number.

    Args:
        name: name of the argument, for the message.
        value: its value.
        allowed: the allowed values as text, for the message.

    Raises:
        InputError: otherwise.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"found {value!r}, allowed: {allowed}", name)
