"""The Sobol sequence against SciPy's, which it replaces."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.soft.sobol import sobol
from scipy.stats import qmc


@given(st.integers(0, 2**63), st.integers(0, 10), st.integers(1, 5))
def test_points_are_scipys_bit_for_bit(seed, power, blocks):
    theirs, ours = qmc.Sobol(3, seed=seed), sobol(2**power, seed)
    for _ in range(blocks):
        assert np.array_equal(next(ours), theirs.random(2**power))
