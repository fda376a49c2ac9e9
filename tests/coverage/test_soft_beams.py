"""The soft estimator alone: gradients at singular points."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from place_rings.coverage.soft.beams import RingsAt
from place_rings.coverage.soft.line_of_sight import Occluding
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.sensor_beams import SHAPES, BeamShapes

from ..support.soft_beams import share_and_slopes

RANGE, HALF, SIZE, RADIUS = 1.5, 0.2, 0.05, 0.1
RIM = (RADIUS + RANGE, RANGE * np.tan(HALF), 0.0)
POINTS = {
    "the ring's centre": (0, 0, 0),
    "the ring's axis": (0, 0, 0.4),
    "an apex": (RADIUS, 0, 0),
    "a beam's axis": (RADIUS + 0.5, 0, 0),
    "the base's centre": (RADIUS + RANGE, 0, 0),
    "the base's rim": RIM,
    "behind a sensor": (RADIUS - 0.01, 0, 0),
    "a ball's centre": (0.3, 0.3, 0.3),
    "a body's axis": (0, 0.8, 0),
    "far away": (1e6, 1e6, 0),
}
CASES = {
    **{shape.title: (shape, 0.0) for shape in SHAPES},
    "cones from a distance on": (SHAPES[0], 0.4),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", [0.1, 1e-6])
def test_gradients_are_finite_everywhere(case, width):
    """Of a ring, of a sensor without a ring, and of a ring without sensors; past a ball, which is a
    body of length 0, a body through a sensor, and an obstacle whose plane holds all sensors."""
    shape, near = CASES[case]

    def three(*values):
        return np.array(values, np.float32)

    same = np.ones(3, np.float32)
    which = tuple(np.full(3, each is shape) for each in SHAPES)
    shapes = BeamShapes(HALF * same, RANGE * same, SIZE * same, which, near * same, same < 0)
    z, x, y = np.eye(3, dtype=np.float32)[[2, 0, 1]][:, None].repeat(3, axis=1)
    rings = RingsAt(
        np.zeros((3, 3), np.float32),
        *(z, x, y),
        three(0, 0.3, 0),
        three(0, 0, 0),
        three(4, 1, 0),
        np.array([0, 4, 0], np.int32),
        three(RADIUS, 0, RADIUS),
        shapes,
    )
    bodies = Capsules(
        np.array([(0.3, 0.3, 0.3), (0, -1, 0)], np.float32),
        np.array([(0.3, 0.3, 0.3), (0, 1, 0)], np.float32),
        np.array([0.1, 0.05], np.float32),
    )
    planes = ((np.tile(z[0], (5, 2, 1)), np.zeros((5, 2), np.float32)),)
    start, end = [0.0, 0.5, np.inf, np.inf, 1.0], [np.inf, 0.8, np.inf, np.inf, np.inf]
    dark = np.stack([start, end], axis=-1).astype(np.float32)[:, None]  # one interval each
    points = np.array(list(POINTS.values()), np.float32)
    past = Occluding(bodies, planes, dark)
    share, slopes = share_and_slopes(rings, points, jnp.float32(width), past)
    assert 0 <= share <= 1
    assert all(np.isfinite(a).all() for a in jax.tree.leaves(slopes))
