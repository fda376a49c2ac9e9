"""Shapes checked once for each combination of types and shapes that a function sees.

jaxtyping's verdict on a call depends on nothing else, where no set, no dictionary and no long list
is passed. Its check takes up to a hundred times as long as a short function itself.
"""

import threading
from collections.abc import Callable, Hashable
from functools import wraps
from inspect import isclass
from types import CodeType
from typing import Any

import jaxtyping
import numpy as np

_jaxtyped = jaxtyping.jaxtyped  # the decorator itself, which check_once replaces
_passed: dict[CodeType, set[Hashable]] = {}  # also of functions that are made anew in each call
_LONG = 16  # elements of a list that are compared each
_MANY = 4096  # combinations of one function that are kept


class _UnknownError(Exception):
    """What a value holds decides whether it passes."""


def _kind(value: Any) -> Hashable:
    """All of a value on which the check of a hint depends."""
    kind = type(value)
    if kind is float or value is None:
        return kind
    if isinstance(value, tuple) or (isinstance(value, list) and len(value) <= _LONG):
        return (kind, *map(_kind, value))
    if isinstance(value, int | str | type):  # literals, and sizes that shapes name
        return (kind, value)
    if isinstance(value, list | dict | set | frozenset):
        raise _UnknownError
    if isinstance(value, np.ndarray) or hasattr(value, "dtype"):
        return (kind, value.shape, value.dtype)
    return (kind, value.__class__)  # of a stand-in, that of its specification


def _call(args: tuple[Any, ...], kwargs: dict[str, Any]) -> Hashable:
    return (*map(_kind, args), *((name, _kind(value)) for name, value in kwargs.items()))


def check_once(function: Any = None, *, typechecker: Callable[[Any], Any]) -> Any:
    """The decorator ``jaxtyped``, which checks no combination again that has passed."""
    if function is None:
        return lambda function: check_once(function, typechecker=typechecker)
    if isclass(function) or not hasattr(function, "__code__"):
        return _jaxtyped(function, typechecker=typechecker)
    passed, local, made = _passed.setdefault(function.__code__, set()), threading.local(), []

    @wraps(function)
    def replayed(*args: Any, **kwargs: Any) -> Any:
        return local.out

    def checks() -> list[Any]:
        """The function checked, and the check of what it returned: made when they are needed."""
        if not made:
            made.append([_jaxtyped(one, typechecker=typechecker) for one in (function, replayed)])
        return made[0]

    def keep(key: Hashable) -> None:
        if len(passed) < _MANY:
            passed.add(key)

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        try:
            given = _call(args, kwargs)
        except _UnknownError:
            return checks()[0](*args, **kwargs)
        if given not in passed:
            out = checks()[0](*args, **kwargs)
            keep(given)
            return out
        out = function(*args, **kwargs)
        try:
            both: Hashable = (given, _kind(out))
        except _UnknownError:
            both = None
        if both is None or both not in passed:
            local.out = out
            checks()[1](*args, **kwargs)
            keep(both)
        return out

    return checked
