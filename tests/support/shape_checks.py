"""Shapes checked once for each combination of types and shapes that a function sees.

jaxtyping's verdict on a call depends on nothing else, where no set, no dictionary and no long list
is passed. Its check takes up to a hundred times as long as a short function itself. So the first
calls of a function are all looked at, and then one of many.
"""

import threading
from collections.abc import Callable, Hashable
from functools import cache, wraps
from inspect import isclass
from itertools import count
from types import CodeType
from typing import Any

import jaxtyping
import numpy as np

_jaxtyped = jaxtyping.jaxtyped  # the decorator itself, which check_once replaces
_passed: dict[CodeType, set[Hashable]] = {}  # also of functions that are made anew in each call
_calls: dict[CodeType, "count[int]"] = {}
_LONG = 16  # elements of a list that are compared each
_FIRST, _EVERY = 64, 32  # calls of a function that are all looked at; then one of so many


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
    passed, local = _passed.setdefault(function.__code__, set()), threading.local()
    calls = _calls.setdefault(function.__code__, count())

    @wraps(function)
    def replayed(*args: Any, **kwargs: Any) -> Any:
        return local.out

    # made when they are needed, as a check is compiled
    full = cache(lambda: _jaxtyped(function, typechecker=typechecker))
    of_result = cache(lambda: _jaxtyped(replayed, typechecker=typechecker))

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        call = next(calls)
        if call >= _FIRST and call % _EVERY:
            return function(*args, **kwargs)
        try:
            given = _call(args, kwargs)
        except _UnknownError:
            return full()(*args, **kwargs)
        if given not in passed:
            out = full()(*args, **kwargs)
            passed.add(given)
            return out
        out = function(*args, **kwargs)
        try:
            both: Hashable = (given, _kind(out))
        except _UnknownError:
            both = None
        if both is None or both not in passed:
            local.out = out
            of_result()(*args, **kwargs)
            passed.add(both)
        return out

    return checked
