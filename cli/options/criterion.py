"""Errors of mounting that a search tolerates, from the options."""

from typing import Any

from ...formats.errors import UserError
from .arguments import option_of


def resolve_errors(tolerant: bool, **errors: float | None) -> dict[str, Any]:
    """The errors that are given, as the API takes them; UserError for one without
    ``--tolerant``.
    """
    given = {name: value for name, value in errors.items() if value is not None}
    for name, value in given.items():
        if not tolerant:
            raise UserError(f"{option_of(name)}: found {value:g}, allowed: only with --tolerant")
    return given
