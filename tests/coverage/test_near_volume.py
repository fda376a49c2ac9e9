"""V_N: membership against distances computed another way, a closed form, the space ahead of the
tool, and the guaranteed interval against random points.
"""

import math
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.attached import Attached
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import carried_polyhedra
from place_rings.coverage.robots.robot import BASE, Body
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.polyhedra import box, half_space, hull, polyhedra
from place_rings.coverage.targets.named import Near, named_target
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import count
from scipy.spatial import ConvexHull

from ..strategies.rings import LONGEST, ROBOT_NAMES, poses
from ..strategies.units import GENERATORS, failures, points_mm, uniform_directions
from ..support.scene_tables import reread

RADII = st.integers(20, 600).map(lambda mm: mm / 1000)


def tool(kind, size, centre, link):
    """A box, a hull of eight random points or a capsule, off its link's axis."""
    size, centre = np.array(size) / 1000, np.array(centre) / 1000
    if kind == "capsule":
        solid = Capsules(centre - size / 2, centre + size / 2, size.min())
    elif kind == "box":
        solid = box(centre, size)
    else:
        corners = np.random.default_rng(int(1000 * size.sum())).normal(size=(8, 3))
        solid = hull(centre + corners * size)
    return Attached("tool", link, solid)


TOOLS = st.lists(
    st.builds(
        tool,
        st.sampled_from(["box", "hull", "capsule"]),
        st.tuples(*[st.integers(10, 400)] * 3),
        points_mm(150),
        st.sampled_from(["tcp", "base", "forearm"]),
    ),
    max_size=2,
)


def from_segments(p, a, b):
    """Distances (N, S) of points from segments, as the least over a quadratic's minimum."""
    v, w = b - a, p[:, None] - a
    length = np.maximum((v * v).sum(-1), 1e-18)
    t = np.clip((w * v).sum(-1) / length, 0, 1)
    return np.sqrt(((w - t[..., None] * v) ** 2).sum(-1))


def from_hull(p, corners):
    """Signed distances (N,) of points from a convex hull, from its triangles one by one."""
    convex = ConvexHull(corners)
    a, b, c = (corners[convex.simplices[:, k]] for k in range(3))
    normal, offset = convex.equations[:, :3], convex.equations[:, 3]
    height = p @ normal.T + offset
    distance = np.minimum.reduce([from_segments(p, *ends) for ends in ((a, b), (b, c), (c, a))])
    foot = p[:, None] - height[..., None] * normal
    turns = [
        (np.cross(y - x, foot - x) * np.cross(b - a, c - a)).sum(-1)
        for x, y in ((a, b), (b, c), (c, a))
    ]
    over = np.minimum.reduce(turns) >= 0
    distance = np.where(over, np.abs(height), distance).min(axis=1)
    return np.where((height <= 0).all(axis=1), -distance, distance)


def from_bodies(robot, q, p):
    """Signed distances (N,) of points from the robot's bodies: negative inside."""
    frames, least = np.asarray(forward(robot.chain, q)), np.full(len(p), np.inf)
    for body in robot.bodies:
        T = np.eye(4) if body.frame == BASE else frames[body.frame]
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (body.capsule.start, body.capsule.end))
        least = np.minimum(least, from_segments(p, a[None], b[None])[:, 0] - body.capsule.radius)
    for one in carried_polyhedra(robot, q):
        least = np.minimum(least, from_hull(p, np.asarray(one.edges).reshape(-1, 3)))
    return least


def drawn(name, pose, tools):
    robot = ROBOTS[name].with_links(True)
    return robot.with_attached(tuple(tools)), pose[: len(robot.chain)]


@settings(max_examples=15)
@given(ROBOT_NAMES, poses(LONGEST), RADII, TOOLS, GENERATORS)
def test_a_point_belongs_to_it_if_it_is_within_the_distance_of_a_body_but_not_in_one(
    name, pose, radius, tools, rng
):
    robot, q = drawn(name, pose, tools)
    solid = target_solid(Near(radius), robot, q)
    low, high = solid.bounds()
    p = rng.uniform(low - 0.05, high + 0.05, (1500, 3))
    distance = from_bodies(robot, q, p)
    clear = (np.abs(distance) > 1e-6) & (np.abs(distance - radius) > 1e-6)
    inside = (distance > 0) & (distance < radius)
    assert failures(p[clear], ((solid(p) <= 0) == inside)[clear]) == []
    step = rng.uniform(0, 0.3, (len(p), 1))
    change = np.abs(solid(p) - solid(p + step * uniform_directions(rng, len(p))))
    assert failures(p, change <= step[:, 0] + 1e-9) == []


@settings(max_examples=20)
@given(st.sampled_from(["ur3e", "ur5e", "ur10", "panda"]), poses(LONGEST), GENERATORS)
def test_the_space_ahead_of_the_flange_belongs_to_it_and_mostly_not_to_the_shell(name, pose, rng):
    robot, q = drawn(name, pose, [])
    flange, before = (np.asarray(forward(robot.chain, q))[i, :3, 3] for i in (-1, -2))
    ahead = (flange - before) / np.linalg.norm(flange - before)
    away = uniform_directions(rng, 4000)
    away = away[away @ ahead >= math.cos(math.radians(45))]
    p = flange + rng.uniform(0.15, 0.3, (len(away), 1)) * away
    p = p[from_bodies(robot, q, p) > 0]
    assert failures(p, target_solid(Near(0.3), robot, q)(p) <= 0) == []


def test_the_shell_leaves_out_most_of_the_space_ahead_of_the_flange():
    """At the default pose of a UR5e, within 45 degrees of the flange's axis."""
    robot, rng = ROBOTS["ur5e"].with_links(True), np.random.default_rng(0)
    flange, before = (np.asarray(forward(robot.chain, robot.rest))[i, :3, 3] for i in (-1, -2))
    away = uniform_directions(rng, 100_000)
    away = away[away @ (flange - before) >= math.cos(math.radians(45)) * math.dist(flange, before)]
    p = flange + 0.3 * rng.uniform(0.5**3, 1, (len(away), 1)) ** (1 / 3) * away
    shares = [
        np.mean(target_solid(named_target(name, 0.3), robot, robot.rest)(p) <= 0)
        for name in ("V_S", "V_N")
    ]
    assert shares == pytest.approx([0.187, 1.0], abs=0.01)


@pytest.mark.parametrize(("length", "own", "radius"), [(0.4, 0.05, 0.3), (0.0, 0.1, 0.2)])
def test_the_volume_about_one_capsule_is_the_closed_form(length, own, radius):
    """A capsule grown by the radius, less the capsule; half of it lies on either side of the
    middle."""
    end = np.array([length, 0.0, 0.0])
    rod = Body("rod", BASE, Capsules(np.zeros(3), end, own))
    solid = target_solid(Near(radius), replace(UR10, bodies=(rod,)), UR10.rest)

    def capsule(r):
        return math.pi * r**2 * (length + 4 / 3 * r)

    true = capsule(own + radius) - capsule(own)
    assert count(solid, 0.01) * 1e-6 == pytest.approx(true, rel=0.01)
    plane = replace(half_space(0.0), offset=np.array([length / 2]), normal=np.eye(3)[:1])
    found = bracket(solid, polyhedra((plane,), solid.bounds()), 0.01)
    assert found.volume_low <= true <= found.volume_high
    assert found.low <= 0.5 <= found.high


@settings(max_examples=4)
@given(ROBOT_NAMES, poses(LONGEST), RADII, TOOLS, GENERATORS)
def test_the_guaranteed_interval_holds_the_share_of_random_points(name, pose, radius, tools, rng):
    robot, q = drawn(name, pose, tools)
    solid = target_solid(Near(radius), robot, q)
    cones = sensor_cones(robot, named_setup("n2_16_25"), q)
    found = bracket(solid, cones, 0.1)
    low, high = solid.bounds()
    p = rng.uniform(low, high, (20_000, 3))
    distance = from_bodies(robot, q, p)
    p = p[(distance > 0) & (distance < radius)]
    share = np.mean(np.asarray(cones(p)) <= 0)
    noise = math.sqrt(math.log(2e7) / (2 * len(p)))
    assert found.low - noise <= share <= found.high + noise


def test_parts_of_it_exclude_the_bodies_in_place_of_the_robots_own_volume():
    near, every = Near(0.3), pr.HalfSpace((0, 0, 1), point=(0, 0, 9))
    whole = pr.IntersectionOf([pr.Near(0.3), every], name="all of it").target
    a, b = (target_solid(t, UR10, UR10.rest) for t in (near, whole))
    p = np.random.default_rng(0).uniform(*a.bounds(), (5000, 3))
    assert failures(p, (a(p) <= 0) == (b(p) <= 0)) == []
    tube = UR10.with_links(True)
    own = target_solid(Near(0.02), tube, UR10.rest)
    assert count(own, 0.02) > 0  # nothing would be left beyond V_R


def test_it_is_the_same_in_python_in_files_and_in_commands(run):
    scene = pr.Scene(targets=[pr.Near(0.3)])
    near = pr.verify("n2_16_25", scene, voxel=0.05).coverage
    code, out, _ = run(
        "verify", "n2_16_25", "--target", "V_N", "--radius", "0.3", "--voxel", "0.05", "--json"
    )
    assert code == 0
    assert f'"zeta_percent": {100 * near:.2f}'[:-1] in out
    again = reread(scene)
    assert again.targets == scene.targets


STICK = """
<robot name="stick"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.3"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="k" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.4 0 0.1"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>
"""


def test_a_robot_without_bodies_has_none(run, tmp_path):
    (tmp_path / "stick.urdf").write_text(STICK)
    code, out, err = run("--robot", "stick.urdf", "--target", "V_N:0.3", "--sensors", "8")
    assert (code, out) == (2, "")
    assert "V_N" in err.splitlines()[-1]
    assert "stick" in err.splitlines()[-1]
