"""First returns as the search computes them, against the slower exact ones."""

import numpy as np
from hypothesis import given, settings
from place_rings.coverage.occlusion.first_return import Beam, capsule_gap, capsule_in_beam
from place_rings.placement.search.first_returns import first_returns

from ..strategies.units import GENERATORS, uniform_directions

MANY, NEAR = 4000, 1e-3
"""Pairs of a beam and a capsule; and m and rad, by which results may differ."""


def pairs(rng):
    """Beams and capsules (start, end, radius), of which up to half only graze, within 1 mm."""
    apex, start = rng.uniform(-0.5, 0.5, (2, MANY, 3))
    half_angle, range_m = rng.uniform(0.1, 0.5, MANY), rng.uniform(0.2, 1.5, MANY)
    beam = Beam(apex, uniform_directions(rng, MANY), half_angle, range_m)
    end = start + rng.uniform(0, 1, (MANY, 1)) * uniform_directions(rng, MANY)
    radius = rng.uniform(0.02, 0.12, MANY)
    to_axis = capsule_gap(beam, start, end, np.zeros(MANY))[0]
    grazing = to_axis + rng.uniform(-NEAR, NEAR, MANY)
    some = (np.arange(MANY) % 2 == 0) & (grazing > 0.02) & (grazing < 0.2)
    return beam, (start, end, np.where(some, grazing, radius))


def quick(beam, capsules):
    """First returns as the search has them, in its precision."""
    narrow = [np.asarray(a, np.float32) for a in (*beam, *capsules)]
    return first_returns(Beam(*narrow[:4]), *narrow[4:])


@settings(max_examples=8)
@given(GENERATORS)
def test_no_body_in_a_beam_is_missed_and_none_far_from_it_is_found(rng):
    """Beams past a capsule by a fraction of a millimetre, which a search seeks, are among them."""
    beam, capsules = pairs(rng)
    found = quick(beam, capsules)
    exact, widest = (capsule_in_beam(beam, *capsules, margin)[0] for margin in (0.0, NEAR))
    assert np.isfinite(exact).sum() > MANY / 20
    assert np.all(found <= exact + NEAR)
    # a beam that misses the widened capsule is free; elsewhere hardly a distance is too short
    far = np.isinf(widest)
    assert np.all(np.isinf(found[far]))
    assert np.mean(found[~far] >= widest[~far] - NEAR) > 0.999


def test_a_beam_between_two_balls_along_a_capsule_meets_it():
    """UR10 upper arm: balls 40 mm apart leave a dip of 3 mm, through which a beam seemed to pass.

    The axis of the beam is across the capsule, and its edge 0.2 mm within it, between two balls.
    """
    radius, half_angle = 0.0635, np.radians(12.5)
    start, end = np.array([0.0, 0.0, 0.0]), np.array([0.612, 0.0, 0.0])
    between = 0.612 * 7.5 / 15
    edge = np.array([np.cos(half_angle), np.sin(half_angle)])  # along the beam, and towards the arm
    normal = np.array([-edge[1], edge[0]])
    # 0.4 m from the apex the edge's line is nearest to the capsule's axis
    apex = -(radius - 2e-4) * normal - 0.4 * edge
    beam = Beam(
        np.array([[between, *apex]]),
        np.array([[0.0, 1.0, 0.0]]),
        np.array([half_angle]),
        np.array([1.0]),
    )
    capsules = start[None], end[None], np.array([radius])
    (exact,) = capsule_in_beam(beam, *capsules)[0]
    assert exact < 0.41
    assert abs(quick(beam, capsules)[0] - exact) < 0.01
