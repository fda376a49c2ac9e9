"""Laws of the polynomials for angles: NumPy's functions in 64 bit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.soft.fast_angles import azimuth, direction

coordinates = st.floats(-100, 100, width=32, allow_subnormal=False)


@given(coordinates, coordinates)
def test_azimuths(x, y):
    off = float(azimuth(np.float32(x), np.float32(y))) - np.arctan2(y, x)
    assert abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi) < 4e-6


@given(st.floats(-8, 8, width=32))
def test_directions(turns):
    angle = 2 * np.pi * turns
    np.testing.assert_allclose(
        direction(np.float32(turns)), [np.cos(angle), np.sin(angle)], atol=2e-6
    )
