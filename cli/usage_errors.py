"""Messages for wrong commands, options and values on the command line.

cyclopts has messages of its own. These say what was found and what is allowed, as all others do.
"""

import re
from difflib import get_close_matches
from typing import Literal, get_args, get_origin

from cyclopts import (
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    UnknownOptionError,
    UnusedCliTokensError,
    ValidationError,
)

from ..coverage.definitions.errors import shown

_KINDS = {int: "an integer", float: "a number"}
_LIMITS = {">=": "at least", "<=": "at most", ">": "above", "<": "below"}
_LIMIT = re.compile(r"Must be (>=|<=|>|<) (\S+?)\.")  # the message of cyclopts' validator Number


def usage_line(error: CycloptsError, commands: list[str]) -> str:
    """Return the message for an error of the command line.

    Args:
        error: the error as cyclopts raises it.
        commands: the names of all commands.
    """
    command = " ".join(error.command_chain or ())
    advice = f"see place-rings {command + ' ' * bool(command)}--help"
    match error:
        case UnusedCliTokensError(unused_tokens=[first, *_]) if not command:
            near = get_close_matches(first, commands, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            return f"unknown command {shown(first)}{hint} (allowed: {', '.join(commands)})"
        case UnusedCliTokensError(unused_tokens=[first, *_]):
            return f"{command}: unexpected argument {shown(first)}; {advice}"
        case UnknownOptionError():
            option = error.token.keyword or error.token.value
            names = [name for one in error.argument_collection for name in one.names]
            near = get_close_matches(option, names, n=1, cutoff=0.7)
            return f"unknown option {option}; {f'did you mean {near[0]}?' if near else advice}"
        case MissingArgumentError(argument=argument) if argument is not None:
            name = error.keyword or argument.name
            lacks = "needs a value" if name.startswith("-") else "is missing"
            return f"{command + ': ' * bool(command)}{name} {lacks}; {advice}"
        case CoercionError(token=token, target_type=kind) if token is not None:
            if get_origin(kind) is Literal:
                allowed = ", ".join(map(str, get_args(kind)))
            else:
                allowed = _KINDS.get(kind, "another value") if kind is not None else "another value"
            return f"{_name(error, token.keyword)}: found {shown(token.value)}, allowed: {allowed}"
        case ValidationError(argument=argument) if argument is not None:
            limit = _LIMIT.fullmatch(error.exception_message)
            if limit is not None and argument.tokens:
                token = argument.tokens[0]
                allowed = f"{_LIMITS[limit[1]]} {limit[2]}"
                return f"{_name(error, token.keyword)}: found {token.value}, allowed: {allowed}"
    return str(error)


def _name(error: CycloptsError, keyword: str | None) -> str:
    """Return the option, or the name of the argument, to which an error belongs."""
    if keyword is not None or error.argument is None:
        return keyword or "argument"
    return " ".join([*(error.command_chain or ()), error.argument.name.lstrip("-").upper()])
