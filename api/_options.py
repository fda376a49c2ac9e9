"""Functions of the API whose arguments are the fields of a dataclass."""

import inspect
import textwrap
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from ._errors import input_errors
from .coverage.definitions.docstrings import docstrings
from .coverage.definitions.options import kind_of

P = ParamSpec("P")
C = TypeVar("C")
R = TypeVar("R")
_ITEM = textwrap.TextWrapper(96, initial_indent=" " * 4, subsequent_indent=" " * 8)


def called_with(call: Callable[P, C]) -> Callable[[Callable[[C], R]], Callable[P, R]]:
    """Return a decorator for a function of one ``call``: it takes the fields of ``call`` as its
    arguments, its signature lists them, and its docstring describes them.

    A value that is not allowed raises InputError.
    """
    signature, texts = inspect.signature(call), dict(docstrings(call))
    arguments = [
        p.replace(annotation=kind_of(p.annotation)[0]) for p in signature.parameters.values()
    ]
    for p in signature.parameters.values():
        texts[p.name] += "".join(f" Allowed: {end.allowed}." for end in kind_of(p.annotation)[1])
    items = (_ITEM.fill(f"{p.name}: {texts[p.name]}") for p in arguments)
    lines = "\n".join(["Args:", *items, "", "Returns:"])

    def decorated(function: Callable[[C], R]) -> Callable[P, R]:
        def called(*args: P.args, **given: P.kwargs) -> R:
            with input_errors():
                made = call(*args, **given)
            return function(made)

        vars(call)["__init__"].__qualname__ = function.__name__  # for the message of a TypeError
        document, returns = inspect.getdoc(function) or "", inspect.signature(function)
        called.__name__ = called.__qualname__ = function.__name__
        called.__module__, called.__doc__ = function.__module__, document.replace("Returns:", lines)
        called.__signature__ = returns.replace(parameters=arguments)  # type: ignore[attr-defined]
        return called

    return decorated
