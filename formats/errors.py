"""Errors for the user, which every room may raise; see ``coverage.definitions.errors``."""

from ..coverage.definitions.errors import (
    IN_LINE,
    NAMED,
    InputError,
    UserError,
    explain,
    key_path,
    shown,
    unusable,
)

__all__ = [
    "IN_LINE",
    "NAMED",
    "InputError",
    "UserError",
    "explain",
    "key_path",
    "shown",
    "unusable",
]
