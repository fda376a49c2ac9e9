"""Convex bodies: hulls of discs hold what they stand for, and a proof of disjointness is one."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.solids.convex_bodies import TOUCH, ConvexBodies, Discs, apart
from place_rings.coverage.solids.polyhedra import Polyhedron

from ..strategies.singles import singles
from ..strategies.solids import boxes, pointed_bodies
from ..strategies.units import uniform_directions

UR10 = ROBOTS["ur10"]


def hulls(setup):
    """The beams of a setup with the robot stretched out, and their convex bodies."""
    beams = sensor_cones(UR10, setup, np.zeros(6))
    return beams, ConvexBodies.of([beams.discs(k) for k in range(len(beams))])


@given(single=singles(), seed=st.integers(0, 2**32 - 1))
def test_no_point_of_a_beam_lies_beyond_its_hull_of_discs(single, seed):
    rng = np.random.default_rng(seed)
    beams, bodies = hulls(Setup((), (single,)))
    points, ways = beams.within(0, rng.random((200, 3))), uniform_directions(rng, 50)
    lowest = bodies[np.zeros(50, int)].lowest(ways)
    assert (ways @ points.T >= (lowest * ways).sum(axis=1)[:, None] - 1e-9).all()


@given(pair=st.lists(singles(), min_size=2, max_size=2), seed=st.integers(0, 2**32 - 1))
def test_beams_with_a_common_point_are_not_proven_apart(pair, seed):
    rng = np.random.default_rng(seed)
    beams, bodies = hulls(Setup((), tuple(pair)))
    proven = apart(*(bodies[np.array([i])] for i in (0, 1)))
    common = any(
        (beams.part(beams.within(i, rng.random((500, 3))), 1 - i) <= 0).any() for i in (0, 1)
    )
    assert not (proven[0] and common)


def discs_of(solid: Polyhedron) -> Discs:
    corners = np.unique(solid.edges.reshape(-1, 3), axis=0)
    return Discs(corners, np.zeros(len(corners)), np.array([0.0, 0, 1]))


@given(
    solids=st.lists(boxes(300, (50, 800)) | pointed_bodies(300), min_size=2, max_size=3),
    at=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)
def test_solids_moved_to_a_common_point_are_not_proven_apart(solids, at):
    """Corners of all solids are moved to one point: they touch there, or overlap."""
    each = [discs_of(solid) for solid in solids]
    moved = [d._replace(centre=d.centre - d.centre[0] + np.array(at)) for d in each]
    assert not apart(*(ConvexBodies.of([d]) for d in moved))[0]


@settings(max_examples=200)
@given(
    pair=st.lists(boxes(300, (50, 800)) | pointed_bodies(300), min_size=2, max_size=2),
    seed=st.integers(0, 2**32 - 1),
    gap=st.floats(0.02, 0.5),
)
def test_solids_on_both_sides_of_a_gap_are_proven_apart(pair, seed, gap):
    """A plane is drawn, and each solid moved to its own side of a slab about it."""
    way = uniform_directions(np.random.default_rng(seed), 1)[0]
    low, high = (discs_of(solid) for solid in pair)
    low = low._replace(centre=low.centre - ((low.centre @ way).max() + gap / 2) * way)
    high = high._replace(centre=high.centre - ((high.centre @ way).min() - gap / 2) * way)
    assert apart(ConvexBodies.of([low]), ConvexBodies.of([high]))[0]
    assert gap > TOUCH


def test_three_bodies_of_which_each_two_meet_can_be_apart():
    """Sides of a triangle, as thin capsules, meet at its corners, but not all three anywhere."""
    corner, up = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([0.0, 0, 1])
    sides = [
        ConvexBodies.of([Discs(corner[[i, (i + 1) % 3]], np.zeros(2), up, 0.05)]) for i in range(3)
    ]
    assert not any(apart(sides[i], sides[j])[0] for i in range(3) for j in range(i))
    assert apart(*sides)[0]
