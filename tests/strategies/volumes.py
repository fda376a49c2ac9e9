"""Volumes of one's own: single ones, and trees of unions, differences and intersections."""

from dataclasses import replace

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
from place_rings.coverage.targets.own import Box, Cone, Cylinder, HalfSpace, Sphere
from place_rings.coverage.targets.posed_robot import PosedRobot, Shape
from place_rings.coverage.targets.target import Target

from .units import FACINGS, TURNS, directions, points_mm

ANYWHERE = PosedRobot(UR10, UR10.rest, Shape(), None, Safety())
"""Where volumes are made that do not depend on it."""
PLACES = points_mm(900).map(lambda mm: tuple(x / 1000 for x in mm))
_MM = st.integers(100, 1500)
SIZES = _MM.map(lambda mm: mm / 1000)
BOXES = st.builds(Box, st.tuples(SIZES, SIZES, SIZES), PLACES, TURNS)
CYLINDERS = st.builds(
    Cylinder, st.integers(50, 800).map(lambda mm: mm / 1000), SIZES, PLACES, TURNS
)
CONES = st.builds(
    Cone, st.integers(50, 800).map(lambda mm: mm / 1000), SIZES | st.just(0.0), SIZES, PLACES, TURNS
)
BALLS = st.builds(Sphere, st.integers(50, 900).map(lambda mm: mm / 1000), PLACES)
HALF_SPACES = st.builds(HalfSpace, FACINGS.map(directions), PLACES)
NAMED = st.one_of(
    st.sampled_from([ReachSphere(), ToolSphere(), ReachAndToolSpheres(), RobotVolume()]),
    st.integers(200, 1200).map(lambda mm: Shell(mm / 1000)),
    st.integers(20, 1200).map(lambda mm: Near(mm / 1000)),
)


def _combined(inner: st.SearchStrategy[Target]) -> st.SearchStrategy[Target]:
    rules = st.sampled_from([UnionOf, DifferenceOf, IntersectionOf])
    parts = st.lists(inner, min_size=2, max_size=3)
    return st.builds(lambda rule, of: rule(of), rules, parts)


VOLUMES = st.recursive(
    st.one_of(BOXES, CYLINDERS, CONES, BALLS, HALF_SPACES, NAMED), _combined, max_leaves=5
).filter(lambda volume: volume.bounded)
"""Volumes with an end; some are empty."""

OWN_TARGETS = VOLUMES.map(lambda volume: replace(volume, name="my own"))
