"""Volumes of one's own: single ones, and trees of unions, differences and intersections."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.coverage.volumes import (
    BallVolume,
    BoxVolume,
    CombinedVolume,
    CylinderVolume,
    HalfSpaceVolume,
    NamedVolume,
    Volume,
)

from .units import FACINGS, TURNS, directions, metres, points_mm

Three = tuple[int, int, int]


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def turned_box(size_mm: Three, centre_mm: Three, turn_deg: Three) -> BoxVolume:
    """A box."""
    turn = _three(np.radians(turn_deg))
    return BoxVolume(_three(metres(size_mm)), _three(metres(centre_mm)), turn)


def turned_cylinder(
    radius_mm: int, height_mm: int, centre_mm: Three, turn_deg: Three
) -> CylinderVolume:
    """A cylinder."""
    centre, turn = _three(metres(centre_mm)), _three(np.radians(turn_deg))
    return CylinderVolume(radius_mm / 1000, height_mm / 1000, centre, turn)


def ball(radius_mm: int, centre_mm: Three) -> BallVolume:
    """A sphere."""
    return BallVolume(radius_mm / 1000, _three(metres(centre_mm)))


def half_space(facing_deg: tuple[int, int], point_mm: Three) -> HalfSpaceVolume:
    """A half-space."""
    return HalfSpaceVolume(_three(directions(facing_deg)), _three(metres(point_mm)))


PLACES = points_mm(900)
SIZES = st.integers(100, 1500)
BOXES = st.builds(turned_box, st.tuples(SIZES, SIZES, SIZES), PLACES, TURNS)
CYLINDERS = st.builds(turned_cylinder, st.integers(50, 800), SIZES, PLACES, TURNS)
BALLS = st.builds(ball, st.integers(50, 900), PLACES)
HALF_SPACES = st.builds(half_space, FACINGS, PLACES)
NAMED = st.one_of(
    st.sampled_from(["V_O", "V_T", "V_OT", "V_R"]).map(NamedVolume),
    st.integers(200, 1200).map(lambda mm: NamedVolume("V_S", mm / 1000)),
    st.integers(20, 1200).map(lambda mm: NamedVolume("V_N", mm / 1000)),
)


def _combined(inner: st.SearchStrategy[Volume]) -> st.SearchStrategy[Volume]:
    return st.builds(
        CombinedVolume,
        st.sampled_from(["union", "difference", "intersection"]),
        st.lists(inner, min_size=2, max_size=3).map(tuple),
    )


VOLUMES = st.recursive(
    st.one_of(BOXES, CYLINDERS, BALLS, HALF_SPACES, NAMED), _combined, max_leaves=5
).filter(lambda volume: volume.bounded)
"""Volumes with an end; some are empty."""

OWN_TARGETS = st.builds(Target, st.just("my own"), st.none(), VOLUMES)
