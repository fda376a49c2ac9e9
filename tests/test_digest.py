"""A cell is measured again if, and only if, code changed that its task can reach."""

import ast
import inspect
import shutil
import subprocess
import sys
from importlib import import_module
from itertools import cycle
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from place_rings.studies.engine import digest as digests
from place_rings.studies.engine.digest import digest, program
from place_rings.studies.engine.import_closure import ROOT, idle, import_closure, read_code
from place_rings.studies.engine.registry import TASKS

from .rooms import modules, rooms

for _file in sorted((ROOT / "studies").rglob("*.py")):  # those that register tasks do so
    if "@register" in _file.read_text():
        import_module(".".join(("place_rings", *_file.relative_to(ROOT).with_suffix("").parts)))

FILES = sorted({Path(inspect.getfile(task)).relative_to(ROOT) for task in TASKS.values()})
COUNTING, SEARCHING = (
    Path(f"studies/engine/{name}.py") for name in ("counting_tasks", "searching_tasks")
)
MODULES = [file.relative_to(ROOT) for _, file in modules(ROOT)]
IN_PLACE = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of all rooms, as a plain installation lays them."""
    house = tmp_path_factory.mktemp("site").resolve() / "place_rings"
    for room in rooms(ROOT):
        shutil.copytree(ROOT / room, house / room, ignore=shutil.ignore_patterns("__pycache__"))
    return house


@pytest.fixture(scope="module")
def before(house):
    """The digests of the copy as it is."""
    return all_digests(house)


@pytest.fixture(scope="module")
def closures(house):
    """The import closure of each module with tasks."""
    return {file: import_closure([house / file], house) for file in FILES}


def all_digests(root):
    return {file: digest(root / file, root) for file in FILES}


def changed(house, before, module, text):
    """The modules with tasks whose digests another text of a module changes."""
    file = house / module
    kept = file.read_text()
    try:
        file.write_text(text)
        after = all_digests(house)
    finally:
        file.write_text(kept)
    return {name for name in before if before[name] != after[name]}


class Documented(ast.NodeTransformer):
    """Gives every class and function another docstring, and every statement of one a text."""

    def generic_visit(self, node):
        super().generic_visit(node)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.Expr(ast.Constant("Said otherwise."))
            body = [item for item in node.body if not idle(item)]
            node.body = [text, *(part for item in body for part in (item, text))]
        return node


class Undocumented(ast.NodeTransformer):
    """Takes every docstring away."""

    def generic_visit(self, node):
        super().generic_visit(node)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [i for i in node.body if not idle(i)] or [ast.Pass()]
        return node


def rewritten(source, transformer=None):
    """A module's text as Python itself lays it out: no comment, no blank line in a function."""
    tree = ast.parse(source)
    if transformer is not None:
        tree = ast.fix_missing_locations(transformer.visit(tree))
    return ast.unparse(tree)


@pytest.mark.long
def test_comments_docstrings_and_layout_change_no_module():
    """Each text is laid out anew, too; every second one gets docstrings, the others lose them."""
    for module, transformer in zip(MODULES, cycle((Documented(), Undocumented())), strict=False):
        source = (ROOT / module).read_text()
        other = rewritten(source, transformer)
        assert other != source or not source
        assert read_code(other.encode()).form == read_code(source.encode()).form, module


@pytest.mark.long
@IN_PLACE
@given(st.sampled_from(MODULES), st.data())
def test_comments_and_blank_lines_change_no_digest(house, before, module, data):
    lines = (house / module).read_text().split("\n")
    starts = {node.lineno - 1 for node in ast.parse("\n".join(lines)).body} | {len(lines)}
    at = data.draw(st.sampled_from(sorted(starts)))
    text = data.draw(st.sampled_from(["", "# a comment", "\n\n# two\n# lines\n"]))
    text = "\n".join([*lines[:at], text, *lines[at:]])
    assert changed(house, before, module, text) == set()


@IN_PLACE
@given(st.sampled_from(MODULES), st.data())
def test_a_changed_number_changes_the_tasks_that_reach_it_and_no_other(
    house, before, closures, module, data
):
    tree = ast.parse((house / module).read_text())
    numbers = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and type(node.value) in (int, float)
    ]
    assume(numbers)
    data.draw(st.sampled_from(numbers)).value += 1
    reaching = {file for file in FILES if house / module in closures[file]}
    assert changed(house, before, module, ast.unparse(tree)) == reaching


@pytest.mark.parametrize("file", FILES, ids=str)
def test_no_task_reaches_commands_pages_or_the_rig(file, house, closures):
    tops = {module.relative_to(house).parts[0] for module in closures[file]}
    assert tops <= {"coverage", "objectives", "placement", "simulation", "formats", "studies"}


def test_counts_do_not_depend_on_the_search(house, closures):
    assert not [file for file in closures[COUNTING] if house / "placement" in file.parents]
    assert house / "placement/search/search.py" in closures[SEARCHING]


@pytest.mark.long
@pytest.mark.parametrize("file", FILES, ids=str)
def test_what_a_task_loads_is_in_its_closure(file):
    """Python's own import of the task's module, in a process of its own, against what is found
    in the import statements.
    """
    name = ".".join(("place_rings", *file.with_suffix("").parts))
    code = (
        f"import sys, {name}\n"
        "for name, module in sys.modules.items():\n"
        "    if name.startswith('place_rings.') and module.__file__: print(module.__file__)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    ).stdout.split()
    assert len(loaded) > 20
    assert {Path(file).resolve() for file in loaded} <= import_closure([ROOT / file])


def test_no_task_loads_modules_that_no_import_statement_names(closures):
    for module in set().union(*closures.values()):
        assert not read_code(module.read_bytes()).dynamic, module


@pytest.mark.parametrize(
    "statement",
    [
        "from importlib import import_module",
        "from importlib import import_module as load",
        "import importlib",
        "import importlib as loading",
        "def f(name):\n    return __import__(name)",
        "import builtins\nbuiltins.__import__('a')",
        "from importlib.util import module_from_spec, spec_from_file_location",
        "import importlib.util\nimportlib.util.spec_from_file_location('a', 'a.py')",
        "from runpy import run_path",
        "import pkgutil",
        "exec('import a')",
    ],
)
def test_a_dynamic_import_is_seen(statement):
    assert read_code(statement.encode()).dynamic


@pytest.mark.parametrize(
    "statement",
    [
        "from importlib.metadata import version",
        "from importlib.util import find_spec",
        "import importlib.metadata",
        "import re\nre.compile('import_module')",
        "'import_module'",
    ],
)
def test_what_loads_no_module_dynamically_is_not(statement):
    assert not read_code(statement.encode()).dynamic


def test_a_checkout_and_an_installation_have_the_same_digests(before):
    assert all_digests(ROOT) == before
    assert program(TASKS["zeta"]).endswith(f"+{before[COUNTING]}")


@pytest.fixture
def tree(tmp_path):
    """Write rooms of a few files; the folder they lie in."""

    def write(**files):
        for name, text in files.items():
            file = tmp_path.joinpath(*name.split("__")).with_suffix(".py")
            file.parent.mkdir(parents=True, exist_ok=True)
            (file.parent / "__init__.py").touch()
            file.write_text(text)
        (tmp_path / "__init__.py").unlink(missing_ok=True)
        return tmp_path

    return write


def reached(root, module):
    """The files that a module reaches, without the ``__init__.py`` of packages."""
    files = import_closure([root / module], root)
    return {file.relative_to(root).as_posix()[:-3] for file in files if file.name != "__init__.py"}


@pytest.mark.parametrize(
    "statement",
    [
        "from ..low.leaf import X",
        "from ..low import leaf",
        "from .. import low\nfrom ..low import leaf",
        "import place_rings.low.leaf",
        "import place_rings.low.leaf as leaf",
        "from place_rings.low import leaf",
        "from place_rings.low.leaf import X",
        "from ..low.leaf import *",
        "def f():\n    from ..low.leaf import X",
        "class A:\n    def f(self):\n        if self:\n            import place_rings.low.leaf",
        "try:\n    from ..low import leaf\nexcept ImportError:\n    leaf = None",
        "if TYPE_CHECKING:\n    pass\nelse:\n    from ..low import leaf",
    ],
)
def test_every_kind_of_import_is_followed(statement, tree):
    root = tree(high__task=statement, low__leaf="X = 1", low__other="")
    assert reached(root, "high/task.py") == {"high/task", "low/leaf"}


@pytest.mark.parametrize(
    "statement",
    [
        "import low.leaf",
        "from numpy import leaf",
        "if TYPE_CHECKING:\n    from ..low import leaf",
        "if typing.TYPE_CHECKING:\n    from ..low import leaf",
        "'from ..low import leaf'",
    ],
)
def test_what_loads_no_module_of_ours_is_not_followed(statement, tree):
    root = tree(high__task=statement, low__leaf="X = 1")
    assert reached(root, "high/task.py") == {"high/task"}


def test_a_circle_of_imports_ends(tree):
    root = tree(high__a="from . import b", high__b="from . import c", high__c="from . import a")
    assert reached(root, "high/a.py") == {"high/a", "high/b", "high/c"}
    assert len({digest(root / f"high/{name}.py", root) for name in "abc"}) == 1


def test_code_in_a_package_counts_for_all_its_modules(tree):
    root = tree(high__task="from ..low import leaf", low__leaf="X = 1")
    before = digest(root / "high/task.py", root)
    (root / "low/__init__.py").write_text('"""A text."""')
    assert digest(root / "high/task.py", root) == before
    (root / "low/__init__.py").write_text("from . import switches")
    (root / "low/switches.py").write_text("PRECISE = True")
    assert reached(root, "high/task.py") == {"high/task", "low/leaf", "low/switches"}
    assert digest(root / "high/task.py", root) != before


@pytest.mark.parametrize(
    "statement",
    [
        "import place_rings",
        "import place_rings as pr",
        "from place_rings import verify",
        "from place_rings.results import Result",
    ],
)
def test_the_package_itself_stands_for_all_of_ours_wherever_it_is_installed(statement, tree):
    rooms = {"high__task": statement, "low__leaf": "X = 1", "far__other": "Y = 2"}
    root = tree(api__results="Z = 3", **rooms)
    assert reached(root, "high/task.py") == {"high/task", "low/leaf", "far/other", "api/results"}
    before = digest(root / "high/task.py", root)
    for file in (root / "api").iterdir():  # as a plain installation lays them
        file.rename(root / file.name)
    (root / "api").rmdir()
    assert digest(root / "high/task.py", root) == before
    (root / "far/other.py").write_text("Y = 3")
    assert digest(root / "high/task.py", root) != before


def test_a_library_counts_by_its_version_where_it_is_imported(tree, monkeypatch):
    installed = {"numpy": "1", "jax": "1", "jaxlib": "1", "pydantic": "1"}
    monkeypatch.setattr(digests, "version", lambda name: installed[name])
    texts = {"a": "import numpy", "b": "import jax.numpy", "c": "import pydantic, json"}
    root = tree(**{f"high__{name}": text for name, text in texts.items()})

    def now():
        return {name: digest(root / f"high/{name}.py", root) for name in texts}

    for library, counts_for in {"numpy": "a", "jax": "b", "jaxlib": "b", "pydantic": ""}.items():
        before = now()
        installed[library] = "2"
        after = now()
        assert {name for name in texts if before[name] != after[name]} == set(counts_for)
