"""Version of the program that measures a task: a digest of the code that the task can reach.

That code is the *import closure* of the task: its module, the project modules that it imports, also
inside functions, and so on recursively. A module counts by its normal form, the syntax tree without
comments, docstrings, positions and layout. A cell is therefore measured again exactly if a
statement changed that may affect it. Libraries count by their versions.

``place_rings`` itself only forwards names. It counts only where a module imports it, and then
stands for all modules of the project.
"""

import ast
import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]  # folder of the rooms, in a checkout and installed
_PACKAGE = "place_rings"
_FACADE = "api"  # folder of a checkout that is installed as the package itself
# They annotate, read files and query processes; any other library may affect a number.
_DECIDE_NO_NUMBER = frozenset({"jaxtyping", "psutil", "pydantic", "pydantic_core"})
_COMPILED_PARTS = {"jax": "jaxlib"}  # parts in separate distributions
_LAYOUT = frozenset({"ctx", "kind", "type_comment", "type_ignores"})  # fields without meaning


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
    forms, libraries = [], set[str]()
    for module in import_closure([file], root):
        form, imports = _read(module.read_bytes())
        forms.append(f"{_name(module, root)} {form}")
        libraries.update(name.split(".")[0] for level, name, _ in imports if not level)
    return _sha256("\n".join((*sorted(forms), *_versions(libraries))))[:16]


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def import_closure(files: Iterable[Path], root: Path = ROOT) -> set[Path]:
    """Return these files and the project files that they import, recursively."""
    closure: set[Path] = set()
    waiting = {file.resolve() for file in files}
    while waiting:
        file = waiting.pop()
        closure.add(file)
        waiting |= set(_imported(file, root)) - closure
    return closure


def _imported(file: Path, root: Path) -> Iterator[Path]:
    """Yield the project files that one file loads: imported modules and the packages that hold
    them.
    """
    yield from _packages(file.parent, root)
    for level, dotted, names in _read(file.read_bytes())[1]:
        parts = dotted.split(".") if dotted else []
        if level:
            place = file.parents[level - 1].joinpath(*parts)
        elif parts[0] == _PACKAGE:
            place = root.joinpath(*parts[1:])
        else:
            continue
        named = [place / name for name in names] if place.is_dir() else []
        modules = (named or [root]) if place == root else [place, *named]
        if any(_is_facade(module, root) for module in modules):
            yield from _everything(root)
        for module in modules:
            yield from _files(module)
            yield from _packages(module.parent, root)


def _is_facade(module: Path, root: Path) -> bool:
    """Return whether a path is the package itself, or a name in it that is no room."""
    return module == root or (module.parent == root and not _in_room(module, root))


def _in_room(path: Path, root: Path) -> bool:
    """Return whether a path is a room or inside one."""
    if root not in path.parents:
        return False
    room = path.relative_to(root).parts[0]
    return room != "tests" and (root / room / "__init__.py").is_file()


def _files(module: Path) -> list[Path]:
    """Return the file of a module, or the ``__init__.py`` of a package; empty for neither."""
    return [
        file
        for file in (module.with_name(f"{module.name}.py"), module / "__init__.py")
        if file.is_file()
    ]


def _packages(folder: Path, root: Path) -> Iterator[Path]:
    """Yield the ``__init__.py`` of a room's folder and of its parents, which run first."""
    while _in_room(folder, root):
        if (file := folder / "__init__.py").is_file():
            yield file
        folder = folder.parent


def _everything(root: Path) -> Iterator[Path]:
    """Yield all modules of all rooms, and those of the package itself."""
    for folder in root.iterdir():
        if _in_room(folder, root):
            yield from folder.rglob("*.py")
    if (root / "__init__.py").is_file():
        yield from root.glob("*.py")


def _name(file: Path, root: Path) -> str:
    """Return a module's name independent of its installation; for foreign modules the file
    name.
    """
    if not (_in_room(file, root) or file.parent == root):
        return file.name
    parts = file.relative_to(root).parts
    return "/".join(parts[1:] if parts[0] == _FACADE else parts)


def _versions(libraries: Iterable[str]) -> Iterator[str]:
    """Yield the name and version of each library that may affect a number."""
    theirs = set(libraries) - sys.stdlib_module_names - _DECIDE_NO_NUMBER - {_PACKAGE}
    for name in sorted(theirs | {_COMPILED_PARTS[name] for name in theirs & set(_COMPILED_PARTS)}):
        try:
            yield f"{name} {version(name)}"
        except PackageNotFoundError:
            yield f"{name} is not installed"


Import = tuple[int, str, tuple[str, ...]]  # level, module, names


@cache
def _read(source: bytes) -> tuple[str, tuple[Import, ...]]:
    """Return a digest of a module's normal form, and all its import statements."""
    tree = ast.parse(source)
    return _sha256(repr(_normal(tree))), tuple(_imports(tree))


def _normal(node: object) -> object:
    """Return a syntax tree as nested tuples, the same for every version of Python.

    Statements without effect are left out: docstrings, field docstrings, ``pass`` and ``...``.
    """
    match node:
        case ast.AST():
            fields = (
                (name, _normal(value))
                for name, value in ast.iter_fields(node)
                if name not in _LAYOUT and value is not None
            )
            return (type(node).__name__, *(field for field in fields if field[1] != []))
        case list():
            return [_normal(item) for item in node if not _idle(item)]
        case _:
            return ascii(node)


def _idle(item: object) -> bool:
    """Return whether a statement has no effect."""
    return isinstance(item, ast.Pass) or (
        isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant)
    )


def _imports(node: ast.AST) -> Iterator[Import]:
    """Yield the import statements in a tree, except those for type checkers."""
    for child in ast.iter_child_nodes(node):
        match child:
            case ast.Import():
                yield from ((0, alias.name, ()) for alias in child.names)
            case ast.ImportFrom():
                names = tuple(alias.name for alias in child.names)
                yield child.level, child.module or "", names
            case ast.If(test=ast.Name("TYPE_CHECKING") | ast.Attribute(attr="TYPE_CHECKING")):
                yield from _imports(ast.Module(child.orelse, []))
            case _:
                yield from _imports(child)
