"""What the sensors' slopes mean for the rings: by moments, against central differences of where the
sensors are.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounting_errors import MountingErrors, draw_errors, misplaced
from place_rings.coverage.rings.ring import Ring
from place_rings.coverage.rings.ring_kinematics import (
    in_links,
    ring_arrays,
    ring_slopes,
    seen_from,
    sensor_poses,
)
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.soft.sampling import sample
from place_rings.coverage.solids.base import Parts
from place_rings.coverage.targets import Shape, robot_curve

from ..strategies.rings import poses
from ..strategies.units import GENERATORS, failures

RINGS = ring_arrays(
    UR10,
    tuple(Ring(link, 0.0, n) for link, n in (("upper_arm", 5), ("forearm", 3), ("forearm", 4))),
)


@settings(max_examples=20)
@given(
    st.tuples(poses(6, 115), poses(6, 115)),
    st.lists(
        st.tuples(st.integers(10, 90), st.integers(6, 52), st.integers(6, 52)),
        min_size=3,
        max_size=3,
    ),
    st.sampled_from([0, 3]),
    GENERATORS,
)
def test_moments_are_the_central_difference(two_poses, percent_tilt_phase, draws, rng):
    """In two poses, with mounting errors and without, by apexes, axes and ups."""
    frames = forward(UR10.chain, np.stack(two_poses))
    position, *angles = np.array(percent_tilt_phase, float).T
    values = np.stack([position / 100, *np.radians(angles)])
    errors = draw_errors(3, 12, MountingErrors(0.02, 0.2), draws, 0) if draws else None

    def there(x):
        meant = sensor_poses(RINGS, *x)
        return misplaced(RINGS, meant, errors) if errors else type(meant)(*(v[None] for v in meant))

    by = [rng.normal(size=(max(draws, 1), 2, 12, 3)) for _ in range(3)]

    def value(x):
        return sum(
            (b * v).sum()
            for b, v in zip(by, seen_from(RINGS, there(x), frames, up=True), strict=True)
        )

    found = np.stack(
        ring_slopes(
            RINGS, there(values), *(in_links(RINGS, b, frames[None]).sum(axis=1) for b in by)
        )
    )
    for i in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[i] = 1e-6
        assert found[i] == pytest.approx(
            (value(values + step) - value(values - step)) / 2e-6, abs=1e-6
        )


@settings(max_examples=10)
@given(poses(6, 172), GENERATORS)
def test_a_tube_holds_what_its_function_says(q, rng):
    """With the joints drawn, so that discs cross; the points are in the box of the shell, but on no
    surface.
    """
    tube = robot_curve(UR10, q, Shape()).tube(0.5, 20)
    low, high = tube.bounds()
    points = rng.uniform(low, high, (2000, 3))
    assert failures(points, tube.holds(points) == Parts.holds(tube, points)) == []
    assert np.all(tube(sample(tube, 100, 0)) <= 0)
