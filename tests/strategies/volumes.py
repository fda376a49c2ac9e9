"""Volumes of one's own: single ones, and trees of unions, differences and intersections."""

from dataclasses import replace
from typing import Any

from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.separation_distance import Safety
from place_rings.coverage.targets.combined import DifferenceOf, IntersectionOf, UnionOf
from place_rings.coverage.targets.named import (
    Near,
    ReachAndToolSpheres,
    ReachSphere,
    RobotVolume,
    Shell,
    ToolSphere,
)
from place_rings.coverage.targets.own import Box, Capsule, Cone, Cylinder, HalfSpace, Sphere
from place_rings.coverage.targets.posed_robot import PosedRobot, Shape
from place_rings.coverage.targets.target import Target

from .units import FACINGS, TURNS, directions, points_mm

ANYWHERE = PosedRobot(UR10, UR10.rest, Shape(), None, Safety())
"""Where volumes are made that do not depend on it."""
PLACES = points_mm(900).map(lambda mm: tuple(x / 1000 for x in mm))


def _lengths(least_mm: int, most_mm: int) -> st.SearchStrategy[float]:
    return st.integers(least_mm, most_mm).map(lambda mm: mm / 1000)


def _made(kind: type[Target], *fields: st.SearchStrategy) -> st.SearchStrategy[Any]:
    """Targets of a kind from its fields; ``st.builds`` would draw required ones twice."""
    return st.tuples(*fields).map(lambda values: kind(*values))


SIZES = _lengths(100, 1500)
BOXES = _made(Box, st.tuples(SIZES, SIZES, SIZES), PLACES, TURNS)
CYLINDERS = _made(Cylinder, _lengths(50, 800), SIZES, PLACES, TURNS)
CONES = _made(Cone, _lengths(50, 800), SIZES | st.just(0.0), SIZES, PLACES, TURNS)
CAPSULES = _made(Capsule, PLACES, PLACES, _lengths(50, 800))
BALLS = _made(Sphere, _lengths(50, 900), PLACES)
HALF_SPACES = _made(HalfSpace, FACINGS.map(directions), PLACES)
NAMED = st.one_of(
    st.sampled_from([ReachSphere(), ToolSphere(), ReachAndToolSpheres(), RobotVolume()]),
    _lengths(200, 1200).map(Shell),
    _lengths(20, 1200).map(Near),
)


def _combined(inner: st.SearchStrategy[Target]) -> st.SearchStrategy[Target]:
    rules = st.sampled_from([UnionOf, DifferenceOf, IntersectionOf])
    parts = st.lists(inner, min_size=2, max_size=3)
    return st.builds(lambda rule, of: rule(of), rules, parts)


VOLUMES = st.recursive(
    st.one_of(BOXES, CYLINDERS, CONES, CAPSULES, BALLS, HALF_SPACES, NAMED), _combined, max_leaves=5
).filter(lambda volume: volume.bounded)
"""Volumes with an end; some are empty."""

OWN_TARGETS = VOLUMES.map(lambda volume: replace(volume, name="my own"))
