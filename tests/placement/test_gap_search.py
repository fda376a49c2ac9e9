"""The largest gap as a goal of a search: balls that meet beams against points of beams, the places
at which balls have room, and the search by its result."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.ring_views.mount_points import mount_points
from place_rings.coverage.ring_views.ring_views import RingPlaces, ring_views
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.soft.estimator import SHARP
from place_rings.coverage.solids.beams import InBeam
from place_rings.coverage.targets.named import Near, Shell
from place_rings.coverage.targets.own import Box
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.floors import GAP, worth
from place_rings.objectives.gap_goals import gap_points, with_gap_goals
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import sight
from place_rings.objectives.parameterization import decode
from place_rings.objectives.scene import Scene
from place_rings.objectives.smallest_object import bodies_of, gap_excess
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.schedule import Round
from place_rings.placement.search.search import search
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..strategies.singles import SENSORS
from ..strategies.units import GENERATORS, failures

Q = np.radians([-20.0, -60.0, 80.0, -110.0, -90.0, 10.0])
BEAMS = SENSORS | st.builds(Sensor, st.floats(0.05, 3.0), st.floats(0.05, 2.0))
NEAR = 2e-6  # m: the places of the search have 32 bits
QUICK = (Round(2048, 4, 2, 16, 0.3, 8), Round(8192, 2, 2, 16, 0.1, 4))


def nearest(sensor, beams, k, points):
    """The points (N, 3) m of beam ``k`` nearest to points, without occlusion."""
    frame = np.stack([beams.axis[k], *beams.sides(k)])
    near = sensor.nearest(InBeam(*((points - beams.apex[k]) @ frame.T).T))
    return beams.apex[k] + np.stack([near.along, near.across, near.up], axis=1) @ frame


@given(BEAMS, GENERATORS)
def test_no_point_of_a_beam_is_nearer_than_the_nearest_one(sensor, rng):
    """It lies in the beam, and neither points all over the beam nor those around it are nearer."""
    one = MountedSensor("base", (0, 0, 0), (1, 0, 0), sensor, up=(0, 0, 1))
    beams = sensor_cones(UR10, Setup((), (one,)), np.zeros(6))
    points = rng.uniform(-1.7, 1.7, (100, 3))
    there = nearest(sensor, beams, 0, points)
    distance = np.linalg.norm(there - points, axis=1)
    held = beams.part(points, 0) <= 0
    assert failures(points, beams.part(there, 0) <= NEAR) == []
    assert failures(points, ~held | (distance <= NEAR)) == []
    inside = beams.within(0, rng.random((2000, 3)))
    each = np.linalg.norm(inside[:, None] - points, axis=2).min(axis=0)
    assert failures(points, distance <= each + NEAR) == []
    for size in (0.1, 0.01):
        around = there[:, None] + size * rng.standard_normal((100, 50, 3))
        off = np.linalg.norm(around - points[:, None], axis=2)
        outside = beams.part(around.reshape(-1, 3), 0).reshape(off.shape) > 0
        assert failures(points, (outside | (off >= distance[:, None] - NEAR)).all(axis=1)) == []


@given(
    st.sampled_from(("forearm", "upper_arm", "tool")),
    st.integers(1, 12),
    st.floats(-1.2, 1.2),
    BEAMS,
    st.floats(0.01, 0.3),
    GENERATORS,
)
def test_a_ring_counts_the_beams_that_meet_the_ball_about_a_point(
    link, count, tilt, sensor, ball, rng
):
    mount = UR10.mount(link)
    ring = Ring(link, 0.5 * (mount.length > 0), count, tilt, 0.1, 0.09, sensor)
    cones = sensor_cones(UR10, Setup((ring,)), Q)
    points = rng.uniform(-1.5, 1.5, (300, 3)) + cones.apex.mean(axis=0)
    frame = np.asarray(forward(UR10.chain, Q))[mount.frame]
    places = RingPlaces(*(np.array([v]) for v in (ring.position * mount.length, tilt, 0.1)))
    views = ring_views(ring, mount_points(mount, frame, points, ball=ball), places, 12)
    each = [
        np.linalg.norm(nearest(sensor, cones, k, points) - points, axis=1) for k in range(count)
    ]
    clear = (np.abs(np.array(each) - ball) > 1e-5).all(axis=0)
    assert (
        failures(points, ~clear | (views.counts[0] == (np.array(each) <= ball).sum(axis=0))) == []
    )
    alone = ring_views(ring, mount_points(mount, frame, points), places, 12).counts
    assert (alone <= views.counts).all()


@given(st.floats(0.02, 0.2), st.integers(0, 2**31))
def test_where_bodies_hide_points_a_part_of_each_counted_ball_is_in_sight(ball, seed):
    """The function of what the sensors see never exceeds the distance from it; and a ball about a
    point in sight counts."""
    scene = Scene(targets=(Shell(0.5),))
    setup = Setup((scene.ring("forearm", 0.5, 8, tilt=0.4),))
    q, (ring,) = scene.poses[0].q, setup.rings
    cones = sensor_cones(scene.robot, setup, q)
    space = Space(scene, setup)
    points = scene.sample(scene.targets[0], 0, 400, seed)
    drawn = TargetPoints(scene, 400, seed)
    drawn.points, drawn.radius = [points], [ball]
    field = Fields(space, drawn).all
    height = ring.position * scene.robot.mount(ring.link).length
    places = RingPlaces(*(np.array([v]) for v in (height, ring.tilt, ring.phase)))
    counts = ring_views(ring, field.points["forearm"], places, 1, field.past["forearm"]).counts[0]
    seen = np.asarray(sight(scene, cones, q)(points))
    assert failures(points, (counts == 0) | (seen <= ball + 1e-3)) == []
    assert failures(points, (counts > 0) | (seen > -1e-3)) == []


@given(st.floats(0.05, 0.18), st.integers(0, 2**31))
def test_the_places_of_a_gap_have_room_for_its_ball(gap, seed):
    obstacle = Obstacle(centre=(0.5, 0.0, 0.5), size=(0.2, 0.2, 0.2))
    scene = Scene(targets=(Near(0.1, largest_gap=gap),), obstacles=(obstacle,))
    (plain, goal) = with_gap_goals(scene).targets
    assert (plain.largest_gap, goal.largest_gap, goal.at_least) == (None, gap, 1.0)
    assert plain.target == goal.target
    points, radius = gap_points(scene, goal, 0, 200, seed)
    assert 0.375 * gap <= radius <= gap / 2
    solid = scene.solid(goal, 0)
    bodies = bodies_of(scene, 0, solid.bounds())
    assert failures(points, np.asarray(solid(points)) <= 0) == []
    assert failures(points, np.asarray(bodies(points)) >= gap / 2 - 1e-6) == []


def test_a_gap_without_room_is_no_demand():
    scene = Scene(targets=(Near(0.05, largest_gap=0.12),))
    goal = with_gap_goals(scene).targets[1]
    assert gap_points(scene, goal, 0, 50, 0)[1] == np.inf
    space = Space(scene, ring_layout(scene, 1, 4))
    field = Fields.drawn(space, Criterion(), 500, 0).all
    assert (field.held.cell[field.part[:, 1] > 0] > 0).all()


@given(st.floats(0, 1), st.floats(0, 0.999))
def test_a_missed_place_costs_more_than_its_share_and_nothing_costs_where_none_is_missed(zeta, gap):
    weights, least = np.array([1.0, 0.0]), np.array([-1.0, GAP])
    assert worth(np.array([zeta, 1.0]), weights, least) == pytest.approx(zeta, abs=1e-12)
    missed = worth(np.array([zeta, gap]), weights, least)
    assert missed <= zeta - 0.98 * (1 - gap)
    assert missed < worth(np.array([zeta, gap + 1e-3]), weights, least)


def test_sharp_soft_beams_meet_the_balls_within_their_functions():
    scene = Scene.paper(targets=(Shell(0.5),))
    setup, points = ring_layout(scene, 1, 8), scene.sample(scene.targets[0], 0, 500, 0)
    space = Space(scene, setup)
    c = fresh(space, np.random.default_rng(0))
    arrays, where = space.arrays(c)
    value = decode(where, space.values(c))
    cones = sensor_cones(scene.robot, space.setup(c), scene.poses[0].q)
    for ball in (0.0, 0.05):
        soft = SoftCoverage(scene, [(0, 0)], [points], ball=[ball])
        share = float(np.mean(np.asarray(cones(points)) <= ball))
        assert soft.share(arrays, value, SHARP) == pytest.approx(share, abs=0.005)


@pytest.mark.slow
def test_what_a_gap_lacks_is_a_share_of_it_as_what_a_floor_lacks():
    box, setup = Box((0.1, 0.1, 0.1), (0.5, -0.5, 0.5)), ring_layout(Scene(), 1, 4)

    def over(*gaps):
        goals = [replace(box, largest_gap=gap, name=f"{gap} m") for gap in gaps]
        return gap_excess(Scene(targets=tuple(goals)), setup)

    diameter = 0.02 * (1 + over(0.02))
    assert over(0.04) == pytest.approx(diameter / 0.04 - 1)
    assert over(0.02, 0.04) == pytest.approx(over(0.02) + over(0.04))
    assert diameter > 0.04


@pytest.mark.slow
def test_a_search_with_a_largest_gap_leaves_no_larger_sphere():
    box = Box((0.8, 0.8, 0.5), (0.8, 0.0, 0.5), name="box")
    excess = []
    for gap in (None, 0.1):
        scene = Scene(targets=(replace(box, largest_gap=gap),))
        space = Space(scene, ring_layout(scene, 2, 8))
        context = SearchContext(Verifier(scene, 0.02), schedule=QUICK)
        result = search(space, SearchOptions(seed=1), context)
        excess.append(gap_excess(Scene(targets=(replace(box, largest_gap=0.1),)), result.setup))
        assert result.excess == (excess[1] if gap else 0.0)
    assert excess[1] <= excess[0]
