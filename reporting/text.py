"""Counts and lists as text."""

from collections.abc import Sequence


def counted(number: int, thing: str) -> str:
    """Return a count with its noun: ``1 ring``, ``5 rings``."""
    return f"{number:,} {thing}{'s' * (number != 1)}"


def listed(parts: Sequence[str]) -> str:
    """Return a list as text: ``a``, ``a and b``, ``a, b and c``."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else list(parts))
