"""Checks of single arguments; each error states the allowed values in one line."""

import math
import warnings
from collections.abc import Callable
from functools import wraps
from numbers import Real
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from ._errors import InputError
from .coverage.definitions.errors import shown
from .coverage.definitions.options import Whole

P = ParamSpec("P")
R = TypeVar("R")


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator by which a function also accepts the former names of its arguments, with a
    DeprecationWarning.

    Args:
        names: today's name of each argument, by its former one.
    """

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def called(*args: P.args, **given: P.kwargs) -> R:
            for old in names.keys() & given.keys():
                if names[old] in given:
                    raise InputError(f"found together with {old}, its former name", names[old])
                warnings.warn(f"{old} is now called {names[old]}", DeprecationWarning, stacklevel=2)
                given[names[old]] = given.pop(old)
            return function(*args, **given)

        return called

    return decorated


def stepwise(progress: Callable[[int, int], None] | None, total: int) -> Callable[[], None]:
    """Return a function to call after each of ``total`` steps; ``progress`` receives the number of
    finished ones, 0 at once, and the number of all."""
    done = -1

    def tell() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    tell()
    return tell


def refuse_without_urdf(call: Any, *names: str) -> None:
    """Raise InputError if a call has one of these arguments, which say how to read a URDF, but no
    ``urdf``."""
    for name in names if call.urdf is None else ():
        if given := getattr(call, name):
            first = given if isinstance(given, str | Path) else next(iter(given))
            line = f"found {shown(str(first))}, allowed: only with urdf"
            raise InputError(line, name, others=("urdf",))


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
    Whole(least, most).check(name, value)


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


def check_question(detect: Any) -> None:
    """Raise InputError for anything but a question of detection, or none."""
    from .coverage.detection.detection import Detection

    if not isinstance(detect, Detection | None):
        raise InputError(f"found a {type(detect).__name__}, allowed: Detection, None", "detect")


def three(name: str, values: Any) -> tuple[float, float, float]:
    """Return three finite numbers; raise InputError that names the argument otherwise."""
    try:
        x, y, z = (float(value) for value in values)
    except (TypeError, ValueError) as error:
        raise InputError(f"found {values!r}, allowed: three numbers (x, y, z)", name) from error
    if not all(math.isfinite(value) for value in (x, y, z)):
        raise InputError(f"found {values!r}, allowed: finite numbers", name)
    return x, y, z
