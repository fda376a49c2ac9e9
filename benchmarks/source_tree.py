"""Figures of the source tree, read from the syntax of its files for house.py.

A room is a folder at the top with an ``__init__.py``, but the tests. The level of a file is the
number of files in the longest chain of imports inside its room that ends at it.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parent.parent
FRONT = "api"  # the room that is installed as place_rings itself: its imports start at the top
TYPED = ("coverage", "objectives")  # rooms whose parameters should not be of type Any
FILE_LINES, FUNCTION_LINES = 300, 70  # longer ones are listed

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class SourceTree:
    """The files of all rooms below a folder."""

    root: Path = ROOT
    """The folder."""

    @cached_property
    def rooms(self) -> list[str]:
        """The names of all rooms."""
        files = self.root.glob("*/__init__.py")
        return sorted(file.parent.name for file in files if file.parent.name != "tests")

    @cached_property
    def texts(self) -> dict[Path, str]:
        """The text of each file, by its path below the root."""
        files = (file for room in self.rooms for file in sorted((self.root / room).rglob("*.py")))
        return {file.relative_to(self.root): file.read_text() for file in files}

    @cached_property
    def trees(self) -> dict[Path, ast.Module]:
        """The syntax tree of each file."""
        return {file: ast.parse(text) for file, text in self.texts.items()}

    def sub_rooms(self) -> int:
        """Return the number of folders with code inside rooms."""
        return len({file.parent for file in self.texts}) - len(self.rooms)

    def imports(self, file: Path) -> set[Path]:
        """Return the files of the tree that the relative imports of ``file`` name."""
        package = file.parts[1:-1] if file.parts[0] == FRONT else file.parts[:-1]
        names: set[tuple[str, ...]] = set()
        for node in ast.walk(self.trees[file]):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = package[: len(package) - node.level + 1]
                module = (*base, *(node.module.split(".") if node.module else ()))
                names |= {module, *((*module, alias.name) for alias in node.names)}
        places = (Path(*top, *name) for name in names if name for top in ((), (FRONT,)))
        return {place.with_suffix(".py") for place in places} & set(self.texts) - {file}

    @cached_property
    def levels(self) -> dict[str, int]:
        """The highest level of a file in each room."""
        inside = {
            file: {other for other in self.imports(file) if other.parts[0] == file.parts[0]}
            for file in self.texts
        }
        level: dict[Path, int] = {}

        def of(file: Path) -> int:
            if file not in level:
                level[file] = 1 + max(map(of, inside[file]), default=0)
            return level[file]

        return {
            room: max(of(file) for file in inside if file.parts[0] == room) for room in self.rooms
        }

    def classes_defined_twice(self) -> list[str]:
        """Return class names without a leading underscore that several files define."""
        count = Counter(
            node.name
            for tree in self.trees.values()
            for node in ast.walk(tree)
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
        )
        return sorted(name for name, times in count.items() if times > 1)

    def long_files(self) -> list[tuple[int, str]]:
        """Return files of more than ``FILE_LINES`` lines, the longest first."""
        lines = ((len(text.splitlines()), file.as_posix()) for file, text in self.texts.items())
        return sorted((each for each in lines if each[0] > FILE_LINES), reverse=True)

    def functions(self) -> Iterator[tuple[Path, Function]]:
        """Yield all functions and methods with their files."""
        for file, tree in self.trees.items():
            for node in ast.walk(tree):
                if isinstance(node, Function):
                    yield file, node

    def long_functions(self) -> list[tuple[int, str]]:
        """Return functions of more than ``FUNCTION_LINES`` lines, the longest first."""
        lines = (
            ((node.end_lineno or 0) - node.lineno + 1, f"{file.as_posix()}: {node.name}")
            for file, node in self.functions()
        )
        return sorted((each for each in lines if each[0] > FUNCTION_LINES), reverse=True)

    def parameters_of_any(self) -> tuple[int, int]:
        """Return how many annotated parameters of ``TYPED`` rooms contain Any, and all of them."""
        annotations = [
            ast.unparse(parameter.annotation)
            for file, node in self.functions()
            if file.parts[0] in TYPED
            for parameter in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            if parameter.annotation is not None
        ]
        return sum("Any" in text for text in annotations), len(annotations)
