"""Docstrings under the fields of a class, which Python itself drops."""

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise
from textwrap import dedent
from typing import Any


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """Return the classes of a module, by name."""
    body = ast.parse(inspect.getsource(sys.modules[module])).body
    return {node.name: node for node in body if isinstance(node, ast.ClassDef)}


def docstrings(cls: Any) -> dict[str, str]:
    """Return the docstring under each field of a class and its bases, on one line."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        try:
            node: Any = _classes(base.__module__).get(base.__qualname__)
            node = node or ast.parse(dedent(inspect.getsource(base))).body[0]
        except (OSError, TypeError):  # no source
            continue
        for field, text in pairwise(node.body):
            match field, text:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str() as lines)),
                ):
                    texts[name] = " ".join(lines.split())
    return texts
