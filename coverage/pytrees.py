"""Dataclasses of arrays as pytrees: JAX traces through them, and ``mapped`` works without JAX.

Counts, tables and catalogues do not need JAX, which takes longer to load than many a count takes to
run. Tree classes are therefore registered with JAX when any code first imports it.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import fields
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any, TypeVar, cast

_Class = TypeVar("_Class", bound=type)
_Tree = TypeVar("_Tree")
_waiting: list[type] = globals().get("_waiting", [])  # a reload keeps those that wait


def tree(cls: _Class) -> _Class:
    """Register a dataclass whose fields are all arrays or trees as a JAX pytree."""
    cls.tree_fields = tuple(field.name for field in fields(cls))  # type: ignore[attr-defined]
    if "jax" in sys.modules:
        _register(cls)
    else:
        _waiting.append(cls)
    return cls


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


def _register(cls: type) -> None:
    from jax.tree_util import register_dataclass

    register_dataclass(cls, data_fields=cls.tree_fields, meta_fields=())  # type: ignore[attr-defined]


class _OnceJaxIsThere(MetaPathFinder):
    """An import hook that finds JAX as Python does and registers the waiting trees after it loads.

    Looking up JAX's spec without loading it registers nothing.
    """

    def __init__(self) -> None:
        self._looking = False

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "jax" or self._looking:
            return None
        self._looking = True
        try:
            spec = find_spec(name)
        finally:
            self._looking = False
        if spec is None or spec.loader is None:
            return spec
        load = spec.loader.exec_module

        def loaded(module: ModuleType) -> None:
            load(module)
            while _waiting:
                _register(_waiting.pop())

        spec.loader.exec_module = loaded  # type: ignore[method-assign]
        return spec


if "jax" not in sys.modules:
    sys.meta_path.insert(0, _OnceJaxIsThere())
