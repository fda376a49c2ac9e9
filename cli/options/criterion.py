"""Options for the mounting errors that a search tolerates."""

from typing import Any

from ...formats.errors import UserError
from .arguments import option_of


def resolve_errors(tolerant: bool, **errors: float | None) -> dict[str, Any]:
    """Return the errors that were given, as arguments of the API.

    Raises:
        UserError: for an error without ``--tolerant``.
    """
    given = {name: value for name, value in errors.items() if value is not None}
    for name, value in given.items():
        if not tolerant:
            raise UserError(f"{option_of(name)} {value:g}: allowed only with --tolerant; add it")
    return given
