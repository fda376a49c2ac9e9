"""Version of the program that measures a task: a digest of the code that the task can reach.

That code is the *import closure* of the task's module. A module counts by its normal form, without
comments and docstrings. A cell is therefore measured again exactly if a statement changed that may
affect it. Libraries count by their versions.
"""

import inspect
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from .import_closure import PACKAGE, ROOT, ImportGraph, read_code, sha256

# They annotate, read files and query processes; any other library may affect a number.
_DECIDE_NO_NUMBER = frozenset({"jaxtyping", "psutil", "pydantic", "pydantic_core"})
_COMPILED_PARTS = {"jax": "jaxlib"}  # parts in separate distributions


def programs(tasks: Mapping[str, Callable[..., Any]]) -> dict[str, str]:
    """Return the version of the program that measures each task, by the tasks' names."""
    return {name: program(task) for name, task in tasks.items()}


def program(task: Callable[..., Any]) -> str:
    """Return the version of the program that measures a task: that of place-rings, and a
    digest.
    """
    return f"{version('place-rings')}+{digest(Path(inspect.getfile(task)))}"


def digest(file: Path, root: Path = ROOT) -> str:
    """Return 16 hexadecimal digits for the import closure of a module: its code and its libraries.

    Args:
        file: file of the module.
        root: folder of the rooms.
    """
    graph = ImportGraph(root)
    closure = graph.closure([file])
    # a worker may load a file outside the rooms from a folder of its own
    names = {m: m.name if graph.is_foreign(m) else graph.name(m) for m in closure}
    forms = sorted(f"{name} {read_code(m.read_bytes()).form}" for m, name in names.items())
    versions = (
        f"{name} {number}" if number else f"{name} is not installed"
        for name, number in library_versions(closure)
    )
    return sha256("\n".join((*forms, *versions)))[:16]


def library_versions(modules: Iterable[Path]) -> Iterator[tuple[str, str | None]]:
    """Yield the name and version of each library that modules import and that may affect a number;
    None for a library that is not installed.
    """
    imported = {
        name.split(".")[0]
        for module in modules
        for level, name, _ in read_code(module.read_bytes()).imports
        if not level
    }
    theirs = imported - sys.stdlib_module_names - _DECIDE_NO_NUMBER - {PACKAGE}
    for name in sorted(theirs | {_COMPILED_PARTS[name] for name in theirs & set(_COMPILED_PARTS)}):
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, None
