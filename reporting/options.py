"""Options of commands that rooms below the command line define as dataclasses."""

from collections.abc import Sequence

from cyclopts import CoercionError, Parameter, Token, convert


def _whole(_: type[int], tokens: Sequence[Token]) -> int:
    """Return the integer that the user stated; cyclopts alone would round 1.5 to 2.

    Raises:
        CoercionError: for a fraction.
    """
    (token,) = tokens
    try:
        fraction = float(token.value) % 1 != 0
    except ValueError:
        fraction = False  # cyclopts reports the error
    if fraction:
        raise CoercionError(token=token, target_type=int)
    number: int = convert(int, tokens)
    return number


WHOLE = Parameter(converter=_whole)
"""Goes before the other parameters of each option that is an integer."""
