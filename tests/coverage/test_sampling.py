"""The Sobol sequence against SciPy's, and points drawn in a solid against its implicit function."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.soft.sampling import sample
from place_rings.coverage.soft.sobol import sobol
from place_rings.coverage.solids.base import Difference, Intersection, Union
from place_rings.coverage.solids.spheres import Spheres
from scipy.stats import qmc


@given(st.integers(0, 2**63), st.integers(0, 10), st.integers(1, 5))
def test_points_are_scipys_bit_for_bit(seed, power, blocks):
    theirs, ours = qmc.Sobol(3, seed=seed), sobol(2**power, seed)
    for _ in range(blocks):
        assert np.array_equal(next(ours), theirs.random(2**power))


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["shell", "nested", "union", "both"]))
def test_samples_are_the_candidates_inside(seed, form):
    rng = np.random.default_rng(seed)
    outer = Spheres(np.zeros((1, 3)), np.ones(1))
    some, more = (Spheres(rng.normal(size=(2, 3)) / 2, rng.uniform(0.2, 0.5, 2)) for _ in range(2))
    solid = {
        "shell": Difference(outer, some),
        "nested": Difference(outer, Difference(some, more)),
        "union": Union(Difference(outer, some), more),
        "both": Intersection(Difference(outer, some), outer),
    }[form]
    low, high = solid.bounds()
    blocks = sobol(1 << 10, 3)
    candidates = low + (high - low) * np.concatenate([next(blocks) for _ in range(2)])
    inside = candidates[solid(candidates) < 0]
    np.testing.assert_array_equal(sample(solid, len(inside), 3), inside)
