"""Rooms by rule: every folder at the top with an ``__init__.py`` is a room, but the tests."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
_STATEMENTS = ("body", "orelse", "handlers", "finalbody", "cases")
FRONT = "api"  # the room that is installed as place_rings itself


def installed_parts(path: Path) -> tuple[str, ...]:
    """The parts of a path below the root as they stand in the installed package."""
    return path.parts[1:] if path.parts[:1] == (FRONT,) else path.parts


def rooms(root: Path = ROOT) -> list[str]:
    """The names of all rooms."""
    return sorted(
        file.parent.name for file in root.glob("*/__init__.py") if file.parent.name != "tests"
    )


def folders(root: Path = ROOT) -> list[Path]:
    """All rooms and the rooms in them."""
    return sorted({file.parent for room in rooms(root) for file in (root / room).rglob("*.py")})


def modules(root: Path = ROOT) -> Iterator[tuple[str, Path]]:
    """The name by which each file is imported once it is installed, and the file."""
    for room in rooms(root):
        for file in sorted((root / room).rglob("*.py")):
            parts = installed_parts(file.relative_to(root).with_suffix(""))
            yield (
                ".".join(("place_rings", *(parts[:-1] if parts[-1] == "__init__" else parts))),
                file,
            )


def shaped_modules(root: Path = ROOT) -> list[str]:
    """The modules that name shapes, which tests check; the others have none to check.

    Those that name ``Self`` are left out: the checker refuses it in a method that is checked
    without its class.
    """
    texts = {name: file.read_text() for name, file in modules(root)}
    return [
        name
        for name, text in texts.items()
        if "from jaxtyping import" in text and not re.search(r"\bSelf\b", text)
    ]


@cache
def imports(path: Path) -> tuple[tuple[int, str, tuple[str, ...]], ...]:
    """Of each import in a file how many dots it begins with, its module, and its names."""
    found: list[tuple[int, str, tuple[str, ...]]] = []
    nodes: list[ast.AST] = [ast.parse(path.read_text("utf-8"))]
    while nodes:
        node = nodes.pop(0)
        if isinstance(node, ast.Import):
            found += [(0, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = tuple(alias.name for alias in node.names)
            found.append((node.level, node.module or "", names))
        for part in _STATEMENTS:  # an expression imports nothing
            nodes += getattr(node, part, ())
    return tuple(found)


def imported_files(path: Path) -> Iterator[Path]:
    """The files that the relative imports of a file name, but ``__init__.py``."""
    for level, module, names in imports(path):
        if level:
            place = path.parents[level - 1].joinpath(*filter(None, module.split(".")))
            files = (place.with_suffix(".py"), *(place / f"{name}.py" for name in names))
            yield from filter(Path.is_file, files)


@cache
def imported_rooms(path: Path) -> frozenset[str]:
    """The rooms that a test's file imports from, itself or through other files of the tests. The
    package itself is ``api``; the benchmarks count as a room.
    """
    found: set[str] = set()
    for file in imported_files(path):
        found |= imported_rooms(file)
    for level, module, _ in imports(path):
        parts = module.split(".")
        if level:
            continue
        if parts[0] == "place_rings":
            found.add(parts[1] if len(parts) > 1 else FRONT)
        elif parts[0] == "benchmarks" or (ROOT / "benchmarks" / f"{parts[0]}.py").exists():
            found.add("benchmarks")
    return frozenset(found)
