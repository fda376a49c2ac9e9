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
from .arguments import option_of
from .common import WHOLE

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
        if option.name in without:
            continue
        kind, _ = kind_of(option.type)
        text = re.sub(r"``(\w+)``", lambda name: option_of(name[1]), texts[option.name])
        parameters = [
            *([WHOLE] if int in (kind, *get_args(kind)) else []),
            *([Parameter(group=panels[option.name])] if option.name in panels else []),
            *([Parameter(negative=())] if kind is bool else []),
            Parameter(help=text),
        ]
        hint = Annotated[(kind, *parameters)]  # type: ignore[valid-type]
        made.append((option.name, hint, field(default=option.default)))
    module = {"__module__": __name__, "__doc__": options.__doc__}
    new = make_dataclass(options.__name__, made, frozen=True, kw_only=True, namespace=module)
    return Parameter(name="*")(new)
