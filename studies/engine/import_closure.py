"""Import closure of a module: the project files that it can load.

It holds the project modules that a module imports, also inside functions, and so on recursively. A
module counts by its normal form: the syntax tree without comments, docstrings, positions and
layout. Nothing is imported; files are only parsed.

``place_rings`` itself only forwards names. It counts only where a module imports it, and then
stands for all modules of the project. So does a module that loads others by names which no import
statement shows.

A file outside the rooms, such as a benchmark, also reaches the files beside it that it imports. It
often starts processes, so its texts count too: a text that names modules of the project, or a file
beside it, stands for an import.
"""

import ast
import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]  # folder of the rooms, in a checkout and installed
PACKAGE = "place_rings"
_FACADE = "api"  # folder of a checkout that is installed as the package itself
_LAYOUT = frozenset({"ctx", "kind", "type_comment", "type_ignores"})  # fields without meaning
_EVALUATION = frozenset({"exec", "eval", "compile"})
# names by which code reaches a module without an import statement of it, wherever they come from
_DYNAMIC = _EVALUATION | {
    *("import_module", "__import__", "reload", "find_loader", "load_module"),
    *("module_from_spec", "spec_from_file_location", "spec_from_loader", "SourceFileLoader"),
    *("runpy", "run_module", "run_path", "pkgutil", "resolve_name", "zipimport"),
}
_MODULE = re.compile(r"\bplace_rings(?:\.\w+)*")  # a module of the project in a text
_NOT_DATA = frozenset({".py", ".pyc"})

Import = tuple[int, str, tuple[str, ...]]  # level, module, names


@dataclass(frozen=True)
class ModuleCode:
    """What a module's source states."""

    form: str
    """Digest of its normal form, in hexadecimal digits."""
    imports: tuple[Import, ...]
    """All import statements, except those for type checkers."""
    dynamic: frozenset[str]
    """Names that load modules without an import statement; ``re.compile`` is none."""
    texts: tuple[str, ...]
    """All texts, except docstrings."""


@cache
def read_code(source: bytes) -> ModuleCode:
    """Parse the source of a module."""
    tree = ast.parse(source)
    imports, dynamic, texts = list[Import](), set[str](), list[str]()
    _collect(tree, imports, dynamic, texts)
    return ModuleCode(
        sha256(repr(_normal(tree))), tuple(imports), frozenset(dynamic), tuple(dict.fromkeys(texts))
    )


class ImportGraph:
    """The project's files and what each of them loads; every file is read once."""

    def __init__(self, root: Path = ROOT) -> None:
        """Start without any file.

        Args:
            root: folder of the rooms.
        """
        self.root = root.resolve()
        self._loaded: dict[Path, frozenset[Path]] = {}
        self._all: frozenset[Path] | None = None
        self._rooms = {file.parent for file in self.root.glob("*/__init__.py")} - {
            self.root / "tests"
        }

    def closure(self, files: Iterable[Path]) -> set[Path]:
        """Return these files and the project files that they load, recursively."""
        closure: set[Path] = set()
        waiting = {file.resolve() for file in files}
        while waiting:
            file = waiting.pop()
            closure.add(file)
            waiting |= self._loads(file) - closure
        return closure

    def inputs(self, closure: Iterable[Path]) -> set[Path]:
        """Return the data files that modules name: texts with the name of a file or a folder beside
        the module. A folder stands for all data files in it.
        """
        inputs: set[Path] = set()
        for module in closure:
            for text in read_code(module.read_bytes()).texts:
                if text and len(text) < 100 and text.isprintable() and "/" not in text:
                    inputs |= _data(module.parent / text, module.parent)
        return inputs

    def name(self, file: Path) -> str:
        """Return a file's name independent of its installation; for a file outside the checkout its
        folder's name and its own.
        """
        if self.root not in file.parents:
            return f"{file.parent.name}/{file.name}"
        parts = file.relative_to(self.root).parts
        return "/".join(parts[1:] if parts[0] == _FACADE else parts)

    def _loads(self, file: Path) -> frozenset[Path]:
        if file not in self._loaded:
            self._loaded[file] = frozenset(self._imported(file))
        return self._loaded[file]

    def _imported(self, file: Path) -> Iterator[Path]:
        """Yield the project files that one file loads: imported modules and the packages that hold
        them.
        """
        code, foreign, root = read_code(file.read_bytes()), self.is_foreign(file), self.root
        yield from self._packages(file.parent)
        if code.dynamic - (_EVALUATION if foreign else set()):
            yield from self._everything()
        for level, dotted, names in (*code.imports, *(_named(code.texts) if foreign else ())):
            parts = dotted.split(".") if dotted else []
            if level:
                place = file.parents[level - 1].joinpath(*parts)
            elif parts[0] == PACKAGE:
                place = root.joinpath(*parts[1:])
            elif foreign:
                place = file.parent.joinpath(*parts)
            else:
                continue
            named = [place / name for name in names] if place.is_dir() else []
            modules = (named or [root]) if place == root else [place, *named]
            if any(self._is_facade(module) for module in modules):
                yield from self._everything()
            for module in modules:
                yield from _files(module)
                yield from self._packages(module.parent)

    def is_foreign(self, file: Path) -> bool:
        """Return whether a file lies outside the rooms and the package itself."""
        return not (self._in_room(file) or file.parent == self.root)

    def _is_facade(self, module: Path) -> bool:
        """Return whether a path is the package itself, or a name in it that is no room."""
        return module == self.root or (module.parent == self.root and not self._in_room(module))

    def _in_room(self, path: Path) -> bool:
        """Return whether a path is a room or inside one."""
        return path in self._rooms or not self._rooms.isdisjoint(path.parents)

    def _packages(self, folder: Path) -> Iterator[Path]:
        """Yield the ``__init__.py`` of a room's folder and of its parents, which run first."""
        while self._in_room(folder):
            if (file := folder / "__init__.py").is_file():
                yield file
            folder = folder.parent

    def _everything(self) -> frozenset[Path]:
        """Return all modules of all rooms, and those of the package itself."""
        if self._all is None:
            rooms = {file for room in self._rooms for file in room.rglob("*.py")}
            top = self.root.glob("*.py") if (self.root / "__init__.py").is_file() else ()
            self._all = frozenset(rooms | set(top))
        return self._all


def import_closure(files: Iterable[Path], root: Path = ROOT) -> set[Path]:
    """Return these files and the project files that they load, recursively."""
    return ImportGraph(root).closure(files)


def sha256(text: str) -> str:
    """Return the SHA-256 digest of a text in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def _files(module: Path) -> list[Path]:
    """Return the file of a module, or the ``__init__.py`` of a package; empty for neither."""
    return [
        file
        for file in (module.with_name(f"{module.name}.py"), module / "__init__.py")
        if file.is_file()
    ]


def _data(path: Path, folder: Path) -> set[Path]:
    """Return a data file below ``folder``, or all data files below a folder in it."""
    if path.is_dir() and folder in path.resolve().parents:
        return {
            file
            for file in path.rglob("*")
            if file.is_file() and file.suffix not in _NOT_DATA and not file.name.startswith(".")
        }
    return {path} if path.suffix and path.suffix not in _NOT_DATA and path.is_file() else set()


def _named(texts: Iterable[str]) -> Iterator[Import]:
    """Yield the modules that texts name, as import statements."""
    for text in texts:
        yield from ((0, name, ()) for name in _MODULE.findall(text))
        if text.endswith(".py") and text.removesuffix(".py").isidentifier():
            yield 0, text.removesuffix(".py"), ()


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
            return [_normal(item) for item in node if not idle(item)]
        case _:
            return ascii(node)


def idle(item: object) -> bool:
    """Return whether a statement has no effect."""
    return isinstance(item, ast.Pass) or (
        isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant)
    )


def _collect(node: ast.AST, imports: list[Import], dynamic: set[str], texts: list[str]) -> None:
    """Add the import statements in a tree, its dynamic names, and its texts."""
    for child in ast.iter_child_nodes(node):
        match child:
            case ast.Expr(ast.Constant()):
                continue
            case ast.Constant(str(text)):
                texts.append(text)
            case ast.Name(id=name) if name in _DYNAMIC:
                dynamic.add(name)
            case ast.Attribute(attr=name) if name in _DYNAMIC - {"compile", "eval"}:
                dynamic.add(name)
            case ast.Import() | ast.ImportFrom():
                _collect_import(child, imports, dynamic)
            case ast.If(test=ast.Name("TYPE_CHECKING") | ast.Attribute(attr="TYPE_CHECKING")):
                # statements for type checkers load nothing
                _collect(ast.Module(child.body, []), [], dynamic, texts)
                child = ast.Module(child.orelse, [])
        _collect(child, imports, dynamic, texts)


def _collect_import(
    node: ast.Import | ast.ImportFrom, imports: list[Import], dynamic: set[str]
) -> None:
    names = tuple(alias.name for alias in node.names)
    parts = {part for name in names for part in name.split(".")}
    if isinstance(node, ast.Import):
        imports.extend((0, name, ()) for name in names)
        dynamic.update({"importlib"} & set(names))
    else:
        imports.append((node.level, node.module or "", names))
        parts |= set((node.module or "").split("."))
    dynamic.update(parts & _DYNAMIC)
