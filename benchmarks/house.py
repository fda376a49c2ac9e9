"""Size of the source tree: files and lines by room, and long files and functions.

A room is a folder at the top with an ``__init__.py``.
"""

import ast
from pathlib import Path

from common import table

ROOT = Path(__file__).parent.parent
FILE_LINES, FUNCTION_LINES = 300, 70  # longer ones are listed
OTHERS = ("benchmarks", "docs", "results")  # folders without code of the package
_FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)


def report(full: bool) -> list[str]:
    """Read the tree and return blocks of Markdown."""
    rooms = sorted(file.parent.name for file in ROOT.glob("*/__init__.py"))
    rows, long = [], list[tuple[int, str]]()
    for name in (*(room for room in rooms if room != "tests"), "tests", *OTHERS):
        files = [f for f in (ROOT / name).rglob("*") if f.is_file() and f.suffix != ".pyc"]
        code = {f.relative_to(ROOT): f.read_text("utf-8") for f in files if f.suffix == ".py"}
        lines = {file: len(text.splitlines()) for file, text in code.items()}
        size = sum(f.stat().st_size for f in files) / 1e6
        middle = sorted(lines.values())[len(lines) // 2] if lines else "-"
        rows.append((f"{name}/", len(files), len(code), sum(lines.values()), middle, f"{size:.1f}"))
        if name in rooms and name != "tests":
            long += [(n, f"{file}") for file, n in lines.items() if n > FILE_LINES]
            long += [one for file, text in code.items() for one in long_functions(file, text)]
    listed = [(f"`{name}`", count) for count, name in sorted(long, reverse=True)]
    return [
        table(("folder", "files", "of Python", "lines", "lines of a file, median", "MB"), rows),
        f"Files of the package over {FILE_LINES} lines, and functions over {FUNCTION_LINES}:",
        table(("long file or function", "lines"), listed),
    ]


def long_functions(file: Path, text: str) -> list[tuple[int, str]]:
    """Return the lines and names of the long functions of a file."""
    nodes = (node for node in ast.walk(ast.parse(text)) if isinstance(node, _FUNCTION))
    sizes = (((node.end_lineno or 0) - node.lineno + 1, f"{file}: {node.name}") for node in nodes)
    return [(lines, name) for lines, name in sizes if lines > FUNCTION_LINES]
