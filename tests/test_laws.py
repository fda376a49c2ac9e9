"""The laws themselves: what they draw can be read when they fail."""

import ast
import re
from pathlib import Path

import pytest

from .rooms import imported_rooms

LAWS = sorted(
    path for path in Path(__file__).parent.glob("test_*.py") if path.name != Path(__file__).name
)
SEED = re.compile(r"\bseeds?\b|SEED|GENERATORS|2 ?\*\* ?(31|32)")
OTHER = re.compile(r"st\.(sampled_from|booleans)\(")  # says which case, but holds no object
GEOMETRY = {"coverage", "objectives"}
# What a law may draw a seed alone for: the code under test takes the seed or the generator itself,
# or hard cases of a scene were recorded by the seed that draws it.
OWN_SEED = re.compile(r"\bdraw_errors\(|\bfresh\(|\bsample\(|\bdrawn\(seed\)")


def laws(text: str) -> list[tuple[str, list[str], str]]:
    """The name, the drawn arguments and the body of each law in a file's text."""
    found = []
    for node in ast.walk(ast.parse(text)):
        for decorator in getattr(node, "decorator_list", []):
            if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == "given":
                values = [*decorator.args, *(keyword.value for keyword in decorator.keywords)]
                found.append((node.name, [ast.unparse(v) for v in values], ast.unparse(node)))
    return found


def draws_only_a_seed(drawn: list[str]) -> bool:
    """Does a law draw nothing that a reader could look at?"""
    seeds = [argument for argument in drawn if SEED.search(argument)]
    return bool(seeds) and all(SEED.search(argument) or OTHER.match(argument) for argument in drawn)


def test_a_law_of_the_geometry_draws_objects_and_not_a_seed_alone():
    looked_at, unreadable = 0, []
    for path in LAWS:
        if imported_rooms(path) <= GEOMETRY:
            for name, drawn, body in laws(path.read_text()):
                looked_at += 1
                if draws_only_a_seed(drawn) and not OWN_SEED.search(body):
                    unreadable.append(f"{path.name}: {name}")
    assert unreadable == []
    assert looked_at > 50


@pytest.mark.parametrize(
    ("given", "unreadable"),
    [
        ("drawing.seeds", True),
        ("st.integers(0, 2**32 - 1), st.booleans()", True),
        ("GENERATORS", True),
        ("poses(), GENERATORS", False),
        ("st.integers(1, 20)", False),
    ],
)
def test_what_counts_as_a_seed_alone(given, unreadable):
    ((_, drawn, _),) = laws(f"@given({given})\ndef test(*_): ...")
    assert draws_only_a_seed(drawn) == unreadable
