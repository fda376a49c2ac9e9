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

from . import drawing

RINGS = ring_arrays(
    UR10,
    tuple(Ring(link, 0.0, n) for link, n in (("upper_arm", 5), ("forearm", 3), ("forearm", 4))),
)


@settings(max_examples=20)
@given(drawing.seeds, st.sampled_from([0, 3]))
def test_moments_are_the_central_difference(seed, draws):
    """In two poses, with mounting errors and without, by apexes, axes and ups."""
    rng = np.random.default_rng(seed)
    frames = forward(UR10.chain, rng.uniform(-2, 2, (2, 6)))
    values = rng.uniform(0.1, 0.9, (3, 3))
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
@given(drawing.seeds)
def test_a_tube_holds_what_its_function_says(seed):
    """With the joints drawn, so that discs cross; the points are in the box of the shell, but on no
    surface.
    """
    rng = np.random.default_rng(seed)
    tube = robot_curve(UR10, rng.uniform(-3, 3, 6), Shape()).tube(0.5, 20)
    low, high = tube.bounds()
    points = rng.uniform(low, high, (2000, 3))
    assert np.array_equal(tube.holds(points), Parts.holds(tube, points))
    assert np.all(tube(sample(tube, 100, seed)) <= 0)
