"""Sets of voxels against Python's sets."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.voxels.voxel_set import OFFSET, VoxelSet, centre, decode, encode

keys = st.sets(st.integers(0, 200), max_size=60)


def made(members):
    key = np.array(sorted(members), np.int64)
    return VoxelSet.of_cells(0.1, key, np.ones(len(key), np.int64))


def members(voxels):
    return {k for a, b in zip(voxels.start, voxels.stop, strict=True) for k in range(a, b)}


@given(keys, keys)
def test_algebra_is_that_of_sets(a, b):
    A, B = made(a), made(b)
    for mine, theirs in ((A | B, a | b), (A & B, a & b), (A - B, a - b)):
        assert members(mine) == theirs
        assert len(mine) == len(theirs)
        assert mine == made(theirs)
        assert np.all(mine.start[1:] > mine.stop[:-1])


@given(keys, st.integers(0, 3))
def test_counting_in_cells(a, level):
    size = 8**level
    cells = np.arange(0, 512, size)
    assert made(a).count_in(cells, size).tolist() == [
        len(a & set(range(c, c + size))) for c in cells
    ]


@given(st.lists(st.tuples(*[st.integers(0, 2**21 - 1)] * 3), max_size=50))
def test_keys_decode_to_the_numbers_they_encode(numbers):
    array = np.array(numbers, np.int64).reshape(-1, 3)
    assert np.array_equal(decode(encode(array)), array)


def test_a_cell_is_one_interval_of_keys():
    numbers = np.stack(np.meshgrid(*[np.arange(8, 16)] * 3, indexing="ij"), -1).reshape(-1, 3)
    found = np.sort(encode(numbers))
    assert np.array_equal(found, np.arange(found[0], found[0] + 512))


def test_centres_lie_on_the_lattice():
    numbers = np.array([[OFFSET, OFFSET - 1, OFFSET + 4]])
    voxels = VoxelSet.of_cells(0.25, encode(numbers), np.array([1]))
    assert voxels.centres().tolist() == [[0.125, -0.125, 1.125]]
    assert voxels.volume == 0.25**3
    assert np.array_equal(centre(numbers, 0, 0.25), voxels.centres())


def test_sets_of_two_lattices_do_not_mix():
    with pytest.raises(ValueError, match=r"0\.1 .*0\.2 "):
        made({1}) | VoxelSet.empty(0.2)
