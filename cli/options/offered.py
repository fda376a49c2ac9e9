"""Command-line options from the fields of options that Python and the command share."""

import re
from collections.abc import Collection, Mapping
from dataclasses import field, fields, make_dataclass
from typing import Annotated, Any, get_args

from cyclopts import Group, Parameter

from ...coverage.definitions.docstrings import docstrings
from ...coverage.definitions.options import Options, kind_of
from .arguments import option_of
from .common import WHOLE


def offered(
    options: type[Options], panels: Mapping[str, Group] | None = None, without: Collection[str] = ()
) -> type[Any]:
    """Return a dataclass whose fields are command-line options: those of ``options``.

    Args:
        options: the class of options; it checks the values.
        panels: panel of the help, by the names of fields.
        without: names of fields that the command does not offer.
    """
    made, texts = [], docstrings(options)
    for option in fields(options):  # type: ignore[arg-type]
        if option.name in without:
            continue
        kind, _ = kind_of(option.type)
        text = re.sub(r"``(\w+)``", lambda name: option_of(name[1]), texts[option.name])
        parameters = [
            *([WHOLE] if int in (kind, *get_args(kind)) else []),
            *([Parameter(group=panels[option.name])] if panels and option.name in panels else []),
            *([Parameter(negative=())] if kind is bool else []),
            Parameter(help=text),
        ]
        hint = Annotated[(kind, *parameters)]  # type: ignore[valid-type]
        made.append((option.name, hint, field(default=option.default)))
    module = {"__module__": __name__, "__doc__": options.__doc__}
    made_class = make_dataclass(options.__name__, made, frozen=True, kw_only=True, namespace=module)
    return Parameter(name="*")(made_class)
