"""Bounds of the shares of voxels hold, against closed forms and points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.solids.base import Difference, Union
from place_rings.coverage.solids.polyhedra import box, polyhedra
from place_rings.coverage.solids.spheres import Spheres
from place_rings.coverage.voxels.voxel_shares import voxel_shares

SIDE = 0.1
places = st.integers(-700, 700).map(lambda mm: mm / 1000)
sizes = st.integers(30, 600).map(lambda mm: mm / 1000)


def overlaps(shares, low, high):
    """Share of each voxel in a box along the axes, by its overlap with each of the axes."""
    ends = [shares.first[k] + np.arange(shares.low.shape[k]) for k in range(3)]
    x, y, z = (
        np.clip(np.minimum((e + 1) * SIDE, b) - np.maximum(e * SIDE, a), 0, None) / SIDE
        for e, a, b in zip(ends, low, high, strict=True)
    )
    return x[:, None, None] * y[:, None] * z


@given(st.tuples(places, places, places), st.tuples(sizes, sizes, sizes), st.integers(0, 2))
def test_shares_of_a_box_are_its_overlaps_with_the_voxels(centre, size, halvings):
    middle, half = np.array(centre), np.array(size) / 2
    solid = polyhedra((box(centre, size),), np.stack([middle - half, middle + half]))
    shares = voxel_shares(solid, SIDE, halvings)
    exact = overlaps(shares, middle - half, middle + half)
    assert exact.sum() * SIDE**3 == pytest.approx(np.prod(size))  # the voxels hold all of it
    assert np.all(shares.low <= exact + 1e-9)
    assert np.all(exact <= shares.high + 1e-9)


@given(st.tuples(places, places, places), places, sizes, st.booleans())
def test_shares_of_combined_solids_hold_those_of_points(centre, other, radius, union):
    a = Spheres(np.array([centre]), np.array([radius]))
    centre_b, size_b = np.array([other, 0.0, 0.0]), np.array([0.4, 0.5, 0.6])
    b = polyhedra((box(centre_b, size_b),), centre_b + np.outer((-1.0, 1.0), size_b / 2))
    solid = Union(a, b) if union else Difference(a, b)
    coarse, fine = voxel_shares(solid, SIDE, 0), voxel_shares(solid, SIDE, 2)
    steps = (np.arange(8) + 0.5) / 8 * SIDE
    axes = [
        ((coarse.first[k] + np.arange(n)) * SIDE)[:, None] + steps
        for k, n in enumerate(coarse.low.shape)
    ]
    points = np.stack(np.meshgrid(*[x.ravel() for x in axes], indexing="ij"), -1).reshape(-1, 3)
    inside = (solid(points) <= 0).reshape([n for k in coarse.low.shape for n in (k, 8)])
    mean = inside.mean(axis=(1, 3, 5))
    error = 0.2  # of 512 points in a voxel, far above that of its surfaces
    for shares in (coarse, fine):
        assert np.all(shares.low <= mean + error)
        assert np.all(mean <= shares.high + error)
        assert shares.low.sum() <= mean.sum() * 1.02 + 0.01
        assert mean.sum() <= shares.high.sum() * 1.02 + 0.01
    assert fine.high.sum() - fine.low.sum() <= coarse.high.sum() - coarse.low.sum() + 1e-9
