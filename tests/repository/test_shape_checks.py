"""Shapes that are checked once for each combination are checked as jaxtyping checks every call."""

import random
from importlib import import_module
from itertools import product
from unittest.mock import patch

import jaxtyping
import numpy as np
import pytest
from beartype import beartype
from hypothesis import given
from hypothesis import strategies as st
from jaxtyping import Float, Int
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.own import within

from ..support import shape_checks
from ..support.shape_checks import _jaxtyped, check_once

SHAPES = st.lists(st.integers(1, 3), min_size=1, max_size=2).map(tuple)
ARRAYS = st.builds(np.zeros, SHAPES, st.sampled_from([float, int]))
VALUES = ARRAYS | st.integers(1, 3) | st.lists(ARRAYS, max_size=2) | st.tuples(ARRAYS, ARRAYS)


def rows(a: Float[np.ndarray, "n 3"], b: Int[np.ndarray, " n"], give: object) -> object:
    return give


def sized(size: int, give: object) -> Float[np.ndarray, "{size} 2"]:
    return give


def several(a: list[Float[np.ndarray, " n"]], give: object) -> tuple[Float[np.ndarray, " n"], ...]:
    return give


PAIRS = [
    (check_once(one, typechecker=beartype), _jaxtyped(one, typechecker=beartype), count)
    for one, count in ((rows, 3), (sized, 2), (several, 2))
]


def passes(function, args):
    try:
        function(*args)
    except jaxtyping.TypeCheckError:
        return False
    return True


@given(st.lists(st.tuples(VALUES, VALUES, VALUES), min_size=1, max_size=8))
def test_every_call_passes_or_fails_as_with_jaxtyping(calls):
    for (once, always, count), values in product(PAIRS, calls * 2):
        with patch.object(shape_checks, "_FIRST", 10**9):
            assert passes(once, values[:count]) == passes(always, values[:count])


def test_another_result_of_the_same_arguments_is_checked():
    results = [np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 3))]

    def next_one(n: int) -> Float[np.ndarray, "{n} 2"]:
        return results.pop(0)

    checked = check_once(next_one, typechecker=beartype)
    assert [passes(checked, (1,)) for _ in range(3)] == [True, True, False]


def test_shapes_of_the_package_are_checked_and_the_state_of_random_stays(monkeypatch):
    monkeypatch.setattr(shape_checks, "_FIRST", 10**9)  # whatever called it before
    ball, state = sphere(np.zeros(3), 1.0), random.getstate()

    @import_module("place_rings_checker").check
    def longest(names: list[str]) -> int:
        return max(map(len, names))

    for _ in range(2):
        longest(["one", "two", "three"])
        within(ball, np.array([[-2.0, -2, -2], [2, 2, 2]]))
        with pytest.raises(jaxtyping.TypeCheckError):
            within(ball, np.array([[-2.0, -2], [2, 2]]))
    assert random.getstate() == state
