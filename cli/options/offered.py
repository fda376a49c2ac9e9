"""Command-line options from the fields of options that Python and the command share."""

import inspect
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import field, fields, make_dataclass
from functools import wraps
from typing import Annotated, Any, TypeVar, get_args

from cyclopts import Group, Parameter

from ...coverage.definitions.docstrings import docstrings
from ...coverage.definitions.options import Options, kind_of
from .common import WHOLE, option_of

C = TypeVar("C")
F = TypeVar("F", bound=Callable[..., None])


def offering(
    panels: Mapping[str, Group] | None = None, without: Collection[str] = ()
) -> Callable[[F], F]:
    """Return a decorator for a command one of whose parameters is a class of ``Options``: the
    command line offers its fields, and the command receives them checked.

    Args:
        panels: panel of the help, by the names of fields.
        without: names of fields that the command does not offer.
    """

    def decorated(command: Any) -> Any:
        signature = inspect.signature(command)
        (own,) = (p for p in signature.parameters.values() if _is_options(p.annotation))
        given, kind = _offered(own.annotation, panels or {}, without), own.annotation

        @wraps(command)
        def called(*args: Any, **values: Any) -> None:
            values[own.name] = kind(**vars(values.get(own.name, given())))
            command(*args, **values)

        each = [
            p.replace(annotation=given, default=given()) if p is own else p
            for p in signature.parameters.values()
        ]
        called.__signature__ = signature.replace(parameters=each)  # type: ignore[attr-defined]
        called.__annotations__ = command.__annotations__ | {own.name: given}
        return called

    return decorated


def _is_options(annotation: Any) -> bool:
    return inspect.isclass(annotation) and issubclass(annotation, Options)


def _offered(
    options: type[Options], panels: Mapping[str, Group], without: Collection[str]
) -> type[Any]:
    """Return a dataclass whose fields are command-line options."""
    made, texts = [], docstrings(options)
    for option in fields(options):  # type: ignore[arg-type]
        if option.name not in without:
            hint = _hint(option, texts[option.name], panels.get(option.name))
            made.append((option.name, hint, field(default=option.default)))
    module = {"__module__": __name__, "__doc__": options.__doc__}
    new = make_dataclass(options.__name__, made, frozen=True, kw_only=True, namespace=module)
    return Parameter(name="*")(new)


def _hint(option: Any, text: str, panel: Group | None) -> Any:
    """Return the annotation of a field for the command line, with its docstring as help."""
    kind, _ = kind_of(option.type)
    parameters = [
        *([WHOLE] if int in (kind, *get_args(kind)) else []),
        *([Parameter(group=panel)] if panel else []),
        *([Parameter(negative=())] if option.default in (False, ()) else []),
        Parameter(help=re.sub(r"``(\w+)``", lambda name: option_of(name[1]), text)),
    ]
    return Annotated[(kind, *parameters)]


def explained(cls: type[C]) -> type[C]:
    """Take the help of options from the docstrings of a dataclass whose fields they are."""
    texts = docstrings(cls)
    for option in fields(cls):  # type: ignore[arg-type]
        if option.name in texts:
            option.type = _hint(option, texts[option.name], None)
            cls.__annotations__[option.name] = option.type
    return cls
