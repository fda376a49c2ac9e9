"""Docstrings under the fields of a class, which Python itself drops."""

import ast
import inspect
from itertools import pairwise
from textwrap import dedent
from typing import Any


def docstrings(cls: Any) -> dict[str, str]:
    """Return the docstring under each field of a class and its bases, on one line."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        try:
            body = ast.parse(dedent(inspect.getsource(base))).body[0].body  # type: ignore[attr-defined]
        except (OSError, TypeError):  # no source
            continue
        for field, text in pairwise(body):
            match field, text:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str() as lines)),
                ):
                    texts[name] = " ".join(lines.split())
    return texts
