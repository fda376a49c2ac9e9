"""The guaranteed interval: it holds the truth, always, and shrinks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.certified import bracket
from place_rings.coverage.solids import Cones, Difference, sphere

from . import drawing
from .test_octree import drawn_scene


@settings(max_examples=12)
@given(drawing.seeds)
def test_holds_the_share_of_many_points(seed):
    """Hoeffding: 2e5 points are off by more than 0.65 points once in 10^7."""
    solid, cones, _ = drawn_scene(seed, "touch")
    low, high = solid.bounds()
    p = np.random.default_rng(seed).uniform(low, high, (200_000, 3)).astype(np.float64)
    p = p[solid(p) <= 0]
    share = float((cones(p) <= 0).mean())
    noise = math.sqrt(math.log(2e7) / (2 * len(p)))
    box = float(np.prod(high - low))
    for voxel in (0.2, 0.06):
        b = bracket(solid, cones, voxel)
        assert b.low - noise <= share <= b.high + noise
        assert b.volume_low <= len(p) / 200_000 * box + noise * box
        assert b.volume_high >= len(p) / 200_000 * box - noise * box


def test_holds_a_closed_form_and_shrinks():
    """A cone whose apex is the centre of a ball: its share of the ball is (1 - cos a) / 2."""
    half = 0.4
    ball = sphere([0.0, 0, 0], 1.0)
    wide = Cones(np.zeros((1, 3)), np.array([[0.6, 0, 0.8]]), np.array([half]), np.array([2.0]))
    truth = (1 - math.cos(half)) / 2
    widths = []
    for voxel in (0.1, 0.05, 0.025):
        b = bracket(ball, wide, voxel)
        assert b.low <= truth <= b.high
        assert b.volume_low <= 4 / 3 * math.pi <= b.volume_high
        widths.append(b.high - b.low)
    assert widths[2] < widths[0] / 3


def test_wholly_seen_and_wholly_unseen():
    ball = sphere([0.0, 0, 0], 0.3)
    around = Cones(np.array([[0.0, 0, -5]]), np.array([[0.0, 0, 1]]), np.array([0.5]), np.array([10.0]))
    away = Cones(np.array([[0.0, 0, 5]]), np.array([[0.0, 0, 1]]), np.array([0.5]), np.array([1.0]))
    assert bracket(ball, around, 0.05).low == bracket(ball, around, 0.05).high == 1
    assert bracket(ball, away, 0.05).low == bracket(ball, away, 0.05).high == 0


def test_an_empty_target_is_refused():
    nothing = Difference(sphere([0.0, 0, 0], 0.3), sphere([0.0, 0, 0], 2.0))
    with pytest.raises(ValueError, match="empty"):
        bracket(nothing, sphere([0.0, 0, 0], 1.0), 0.1)
