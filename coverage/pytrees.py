"""Dataclasses of arrays as pytrees: JAX traces through them, and ``mapped`` works without JAX.

Counts, tables and catalogues do not need JAX, which takes longer to load than many a count takes to
run. Tree classes therefore wait until a module that traces through them calls ``register_trees``.
"""

import sys
from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar, cast

_Class = TypeVar("_Class", bound=type)
_Tree = TypeVar("_Tree")
_waiting: list[type] = []


def tree(cls: _Class) -> _Class:
    """Register a dataclass whose fields are all arrays or trees as a JAX pytree."""
    cls.tree_fields = tuple(field.name for field in fields(cls))  # type: ignore[attr-defined]
    _waiting.append(cls)
    if "jax" in sys.modules:
        register_trees()
    return cls


def register_trees() -> None:
    """Load JAX and register all tree classes that it does not know yet."""
    from jax.tree_util import register_dataclass

    while _waiting:
        cls: Any = _waiting.pop()
        register_dataclass(cls, data_fields=cls.tree_fields, meta_fields=())


def mapped(function: Callable[[Any], Any], values: _Tree) -> _Tree:
    """Return a tree of the same structure with ``function`` applied to each array."""
    if hasattr(values, "tree_fields"):
        return type(values)(
            **{name: mapped(function, getattr(values, name)) for name in values.tree_fields}
        )
    if isinstance(values, tuple):
        make = getattr(values, "_make", tuple)  # a named or a plain tuple
        return cast(_Tree, make(mapped(function, value) for value in values))
    return values if values is None else cast(_Tree, function(values))
