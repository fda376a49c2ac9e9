"""Counts and lists as text."""

import math
from collections.abc import Sequence


def counted(number: int, thing: str) -> str:
    """Return a count with its noun: ``1 ring``, ``5 rings``."""
    return f"{number:,} {thing}{'s' * (number != 1)}"


def listed(parts: Sequence[str]) -> str:
    """Return a list as text: ``a``, ``a and b``, ``a, b and c``."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else list(parts))


def coverage_caption(target: str, percent: float, dark_percent: float | None) -> str:
    """Return the coverage of a target, with that for dark clothing if it is known, percent."""
    dark = "" if dark_percent is None else f", dark clothing {dark_percent:.1f} %"
    return f"{target}: {percent:.1f} % covered{dark}"


def with_error(percent: float, error: float | None) -> str:
    """Return a coverage in percent with its error in [0, 1], rounded up: ``67.90 ± 0.05``."""
    if error is None:
        return f"{percent:.2f}"
    return f"{percent:.2f} ± {max(math.ceil(round(1e4 * error, 6)), 1) / 100:.2f}"


def duration(seconds: float) -> str:
    """Return an approximate duration: ``about 40 s``, ``about 12 min``, ``about 3.5 h``."""
    if seconds < 90:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 5400 else f"about {seconds / 3600:.1f} h"
