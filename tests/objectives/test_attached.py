"""Tools and payloads: parts of the robot's body that a scene attaches to its links."""

import itertools
from dataclasses import replace

import mujoco
import numpy as np
import place_rings as pr
import pytest
import trimesh
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.robots.attached import Attached, enclosing_capsule
from place_rings.coverage.robots.built_in import ROBOTS, built_in
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from place_rings.coverage.robots.robot import Robot
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.polyhedra import box, placed
from place_rings.coverage.targets.named import ProtectiveVolume, ReachSphere, Shell
from place_rings.objectives.blind_spots import blind_spots
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import occluders, setup_sight, unseeing
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.rig.poses.clear import clear, gaps
from place_rings.rig.sensing.expected import expected
from place_rings.viewer.drawing import Drawing
from place_rings.viewer.drawn_parts import DrawnParts
from place_rings.viewer.quick_estimate import QuickEstimate

from ..strategies.rings import LONGEST, ROBOT_NAMES, setups
from ..strategies.solids import boxes, capsule, pointed_bodies
from ..strategies.units import metres, points_mm

NEAR = Shell(0.5)
TOOL = pr.Attached("tool", centre=[0, 0.1, 0], size=[0.1, 0.2, 0.06])
ANGLES = st.tuples(*[st.integers(-180, 180)] * LONGEST)
LINKS = st.sampled_from(["tcp", "forearm", "upper_arm", "base"])
POLYHEDRA = boxes(300, (40, 400)) | pointed_bodies(300)
CAPSULES = st.builds(capsule, points_mm(300), points_mm(300), st.integers(20, 150)).map(
    lambda c: Capsules(metres(c.start_mm), metres(c.end_mm), c.radius_mm / 1000)
)


def scene_of(robot: Robot, deg: tuple[int, ...], **fields: object) -> Scene:
    pose = Pose(np.radians(deg[: len(robot.chain)]))
    free = replace(robot.unladen or robot, limits=None)  # the pose may lie beyond them
    free = free.with_attached(robot.attached)
    return Scene(robot=free, poses=(pose,), targets=(NEAR,), **fields)


def link_pose(robot: Robot, link: str, q: np.ndarray) -> np.ndarray:
    """T_base_link (4, 4) of a link."""
    frame = robot.carriers[link]
    return np.eye(4) if frame < 0 else np.asarray(forward(robot.chain, q))[frame]


@pytest.mark.parametrize("occlusion", ["shadow", "blind"])
@settings(max_examples=5)
@given(ROBOT_NAMES, ANGLES, LINKS, POLYHEDRA, setups(6, 3))
def test_an_attached_polyhedron_is_an_obstacle_where_its_link_stands(
    occlusion, name, deg, link, body, setup
):
    robot = ROBOTS[name]
    carries = scene_of(robot.with_attached((Attached("a", link, body),)), deg, occlusion=occlusion)
    q = carries.poses[0].q
    there = placed(body, link_pose(robot, link, q))
    stands = scene_of(robot, deg, occlusion=occlusion, obstacles=(Obstacle("a", there),))
    one, other = (Verifier(s, 0.1).verify(setup, NEAR) for s in (carries, stands))
    assert (one.target_voxels, one.covered_voxels) == (other.target_voxels, other.covered_voxels)


@settings(max_examples=6)
@given(ROBOT_NAMES, ANGLES, LINKS, POLYHEDRA, st.booleans())
def test_an_attached_polyhedron_bounds_what_is_reachable_as_an_obstacle_does(
    name, deg, link, body, wall
):
    """Beside a wall, too; if both enclose the robot, both say so."""
    robot, cut = ROBOTS[name], replace(NEAR, reachable=True)
    carries = scene_of(robot.with_attached((Attached("a", link, body),)), deg)
    walls = (Obstacle("wall", box([0.4, 0, 0], [0.1, 9, 9])),) if wall else ()
    there = Obstacle("a", placed(body, link_pose(robot, link, carries.poses[0].q)))
    counts = []
    for scene in (
        replace(carries, obstacles=walls),
        scene_of(robot, deg, obstacles=(*walls, there)),
    ):
        try:
            counts.append(Verifier(scene, 0.1).verify(named_setup("n1_8_0"), cut).target_voxels)
        except ValueError as error:
            counts.append(str(error))
    assert counts[0] == counts[1]


def test_a_lid_at_the_tool_puts_what_lies_in_a_bin_out_of_reach():
    """The bin is open towards the robot, and the tool carries its lid."""
    robot, half, thick = replace(ROBOTS["ur10"], reach=2.0), 0.3, 0.06
    wide, to_tool = 2 * half + thick, np.linalg.inv(link_pose(robot, "tcp", robot.rest))
    sides = [box([1.5, 0, 0.2 + s * half], [0.6, wide, thick]) for s in (-1, 1)]
    sides += [box([1.5, s * half, 0.2], [0.6, thick, wide]) for s in (-1, 1)]
    sides.append(box([1.8, 0, 0.2], [thick, wide, wide]))
    cell = tuple(Obstacle(f"side {i}", one) for i, one in enumerate(sides))
    lid = Attached("lid", "tcp", placed(box([1.2, 0, 0.2], [thick, wide, wide]), to_tool))
    deg, target = tuple(np.degrees(robot.rest)), ReachSphere(reachable=True)
    inside = np.array([[1.4, 0.0, 0.2]])
    for carrier, reached in ((robot, True), (robot.with_attached((lid,)), False)):
        scene = scene_of(carrier, deg, obstacles=cell)
        assert bool(scene.solid(target, 0)(inside)[0] <= 0) == reached


def test_the_body_nearest_to_a_blind_spot_may_be_a_tool():
    robot = ROBOTS["ur10"]
    T = link_pose(robot, "tcp", robot.rest)
    plate = Attached("plate", "tcp", box([0.0, 0.5, 0.0], [0.3, 0.02, 0.3]))
    beyond = T @ np.array([0.0, 0.6, 0.0, 1.0])
    target = pr.Box((0.1, 0.1, 0.1), tuple(beyond[:3]), name="beyond").target
    found = {}
    for carrier in (robot, robot.with_attached((plate,))):
        scene = scene_of(carrier, tuple(np.degrees(robot.rest)))
        (spot,) = blind_spots(Verifier(scene, 0.02), Setup(), target, (0,)).spots
        found[spot.beside.body] = spot.beside.gap
    assert "plate" in found
    assert found.pop("plate") < min(found.values()) - 0.3


@pytest.mark.parametrize("rule", ["centre", "certified"])
@settings(max_examples=2)
@given(ROBOT_NAMES, ANGLES, st.lists(st.tuples(LINKS, POLYHEDRA | CAPSULES), max_size=3), setups(6))
def test_the_octree_counts_what_a_dense_count_finds(rule, name, deg, solids, setup):
    carried = tuple(Attached(f"a{i}", *s) for i, s in enumerate(solids))
    scene = scene_of(ROBOTS[name].with_attached(carried), deg)
    voxel, solid = 0.08, scene.solid(NEAR, 0)
    low, high = solid.bounds() / voxel
    axes = [np.arange(np.floor(a), np.ceil(b)) + 0.5 for a, b in zip(low, high, strict=True)]
    points = voxel * np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = points[np.asarray(solid(points)) <= 0]
    q = scene.poses[0].q
    frames = np.asarray(forward(scene.robot.chain, q))
    for one in carried:  # never part of a target
        local = (inside - link_pose(scene.robot, one.link, q)[:3, 3]) @ link_pose(
            scene.robot, one.link, q
        )[:3, :3]
        value = one.solid.distance(local) if isinstance(one.solid, Capsules) else one.solid(local)
        assert len(inside) == 0 or np.min(value) >= -1e-9
    assert len(robot_capsules(scene.robot, frames)) == len(scene.robot.bodies)
    seen = int(np.asarray(setup_sight(scene, setup, q).holds(inside)).sum())
    if rule == "centre":
        counted = Verifier(scene, voxel, rule).verify(setup, NEAR)
        assert counted.target_voxels == len(inside)
        assert counted.covered_voxels == pytest.approx(seen, abs=1)
    else:
        fine = Verifier(scene, 0.03).verify(setup, NEAR).zeta
        sure = Verifier(scene, None, "certified", 0.1).verify(setup, NEAR)
        assert sure.low - 5e-3 <= fine <= sure.high + 5e-3


@given(ROBOT_NAMES, ANGLES, LINKS, CAPSULES)
def test_an_attached_capsule_moves_with_its_link(name, deg, link, body):
    robot = ROBOTS[name].with_attached((Attached("a", link, body),))
    q = np.radians(deg[: len(robot.chain)])
    T = link_pose(robot, link, q)
    moved = robot_capsules(robot, forward(robot.chain, q))
    for end, at in ((body.start, moved.start), (body.end, moved.end)):
        np.testing.assert_allclose(at[-1], T[:3, :3] @ end + T[:3, 3], atol=1e-9)


@given(POLYHEDRA)
def test_an_enclosing_capsule_contains_every_corner(body):
    corners = body.edges.reshape(-1, 3)
    assert enclosing_capsule(corners).distance(corners).max() <= 1e-9


def test_a_tool_leaves_rings_their_tube_and_is_named_where_it_obstructs_them():
    bare = Scene()
    wide = pr.Attached("bottle", start=[0, 0, 0], end=[0, 0.2, 0], radius=0.09)
    on = replace(bare, attached=(wide,))
    for link in bare.robot.links:  # rings surround the link, not the tool
        assert on.least_radius(link) == bare.least_radius(link)
    ring = Ring("tool", 0.0, 8, radius=bare.radius_of("tool"))
    assert "bottle" not in MountClearance(bare).within(ring)
    assert "bottle" in MountClearance(on).within(ring)
    small = pr.Attached("nut", centre=[0, 0.1, 0], size=[0.05, 0.05, 0.05])
    beyond = replace(bare, attached=(small,))
    assert MountClearance(beyond).within(ring) == MountClearance(bare).within(ring)


def test_a_sensor_inside_a_tool_names_it():
    cover = pr.Attached("cover", link="forearm", centre=[0, 0, 0.3], size=[0.3, 0.3, 0.3])
    scene = pr.Scene(attached=[cover])
    blocked = unseeing(scene, Setup((Ring("forearm", 0.5, 4, radius=0.08),)))
    assert [u.within for u in blocked] == ["cover"] * 4


def test_transparent_bodies_include_tools_but_targets_never_do():
    tool = pr.Attached(link="forearm", centre=[0.25, 0, 0.2], size=[0.1, 0.3, 0.3])
    bare, on = pr.Scene.paper(), pr.Scene.paper(attached=[tool])
    setup = Setup((Ring("upper_arm", 0.5, 8),))
    one, other = (Verifier(s, 0.04).verify(setup, NEAR) for s in (bare, on))
    assert other.target_voxels < one.target_voxels
    q = bare.poses[0].q
    centre = (link_pose(on.robot, "forearm", q) @ [0.25, 0, 0.2, 1])[None, :3]
    assert bare.solid(NEAR, 0)(centre)[0] <= 0 < on.solid(NEAR, 0)(centre)[0]
    assert len(occluders(on, q).obstacles) == 0


def test_both_descriptions_of_the_links_carry_what_is_attached():
    robot = ROBOTS["ur10"].with_attached(
        (TOOL, pr.Attached("ball", radius=0.1, start=[0, 0.1, 0], end=[0, 0.1, 0]))
    )
    for real in (True, False):
        other = robot.with_links(real)
        assert other.attached == robot.attached
        assert other.mounts is ROBOTS["ur10"].with_links(real).mounts
        assert [b.name for b in other.bodies].count("ball") == 1
    assert robot.with_attached(()) is ROBOTS["ur10"]
    assert built_in(robot.unladen)
    assert not built_in(robot)
    paper = pr.Scene.paper(attached=[pr.Attached(link="upper_arm", size=[0.1] * 3)])
    assert paper.replace(rules=pr.Rules()).real


def test_a_robot_that_moves_its_tool_into_itself_is_not_clear():
    stick = pr.Attached("stick", centre=[0, 0.6, 0], size=[0.02, 1.2, 0.02])
    bare, on = Scene(), pr.Scene(attached=[stick])
    rng = np.random.default_rng(0)
    joints = rng.uniform(-np.pi, np.pi, (64, 6))
    pairs = len(bare.robot.bodies)
    more = gaps(on, joints)[0]
    assert more.shape[1] == (pairs + 1) * pairs // 2
    names = [b.name for b in on.robot.enclosed().bodies]
    pair = list(itertools.combinations(names, 2)).index(("upper_arm_1", "stick"))
    assert (more[:, pair] < 0).any()
    assert not clear(on, joints[more[:, pair] < 0]).any()


def test_the_protective_volume_reaches_about_a_tool():
    far = pr.Attached("far", centre=[0, 1.5, 0], size=[0.1, 3.0, 0.1])
    scene = pr.Scene(attached=[far], targets=[pr.ProtectiveVolume()])
    q = scene.poses[0].q
    T = link_pose(scene.robot, "tcp", q)
    beyond = (T[:3, :3] @ [0, 3.1, 0] + T[:3, 3])[None]
    bare = pr.Scene(targets=[pr.ProtectiveVolume()])
    assert scene.solid(ProtectiveVolume(), 0)(beyond)[0] <= 0
    assert bare.solid(ProtectiveVolume(), 0)(beyond)[0] > 0


FILE = """
robot = "ur10e"
[[attached]]
name = "gripper"
centre = [0.0, 0.07, 0.0]
size = [0.1, 0.14, 0.06]
[[attached]]
name = "camera"
link = "forearm"
start = [0.1, 0.0, 0.2]
end = [0.1, 0.0, 0.3]
radius = 0.03
[[attached]]
file = "wedge.stl"
scale = 0.001
link = "wrist_1"
rpy_deg = [0, 0, 90]
"""


def test_a_scene_file_gives_what_python_does_and_is_read_back(tmp_path):
    corners = np.array([[0, 0, 0], [80, 0, 0], [0, 60, 0], [0, 0, 50]], float)
    trimesh.convex.convex_hull(corners).export(tmp_path / "wedge.stl")
    (tmp_path / "scene.toml").write_text(FILE)
    read = pr.load(tmp_path / "scene.toml")
    said = pr.Scene(
        robot="ur10e",
        attached=[
            pr.Attached("gripper", centre=[0, 0.07, 0], size=[0.1, 0.14, 0.06]),
            pr.Attached(
                "camera", link="forearm", start=[0.1, 0, 0.2], end=[0.1, 0, 0.3], radius=0.03
            ),
            pr.Attached("wedge", link="wrist_1", rpy_deg=[0, 0, 90], points=corners / 1000),
        ],
    )
    pr.save(read, tmp_path / "again.toml")
    assert 'robot = "ur10e"' in (tmp_path / "again.toml").read_text()
    again = pr.load(tmp_path / "again.toml")
    counts = [pr.verify("n1_8_0", s, voxel=0.05).coverage for s in (read, said, again)]
    assert counts[0] == counts[1] == counts[2]
    assert [a.name for a in again.attached] == ["gripper", "camera", "wedge"]
    assert not read.attached[2].hulled


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("size = [0.1, 0.1, 0.1]\nlink = 'hand'", '.link: found "hand"'),
        ("link = 'tcp'", "size, file, points, start"),
        ("size = [1, 1, 1]\nfile = 'a.stl'", 'found "size, file"'),
        ("start = [0, 0, 0]", 'found "start"'),
        ("size = [0.1, 0.1, 0.1]\nfloor = 0.0", "floor"),
        ("size = [0.1, -0.1, 0.1]", ".size[1]"),
        ("file = 'none.stl'", ".file: none.stl"),
        ("size = [1, 1, 1]\nscale = 0.001", "scale"),
        ("points = [[0,0,0],[1,0,0],[0,1,0],[1,1,0]]", "found a list of 4"),
    ],
)
def test_what_cannot_be_attached_is_one_line(tmp_path, keys, says):
    (tmp_path / "scene.toml").write_text(f"[[attached]]\n{keys}\n")
    with pytest.raises(pr.InputError) as error:
        pr.load(tmp_path / "scene.toml")
    assert all(part in str(error.value) for part in ("scene.toml: attached[0]", says))
    assert "\n" not in str(error.value)


def test_python_refuses_what_a_file_may_not_say():
    with pytest.raises(pr.InputError, match="Attached"):
        pr.Attached("nothing")
    with pytest.raises(pr.InputError, match='"hand"'):
        pr.Scene(attached=[pr.Attached(link="hand", size=[0.1] * 3)])
    with pytest.raises(pr.InputError, match="bodies"):
        pr.Scene(robot=replace(ROBOTS["ur10"], bodies=()), attached=TOOL)
    with pytest.raises(pr.InputError, match=r"attached\[0\]: found 3"):
        pr.Scene(attached=3)
    with pytest.raises(pr.InputError, match='"wrist_1"'):
        pr.Scene(attached=pr.Attached(link="wrist_1", size=[0.1] * 3)).replace(robot="panda")
    scene = pr.Scene(attached=TOOL).replace(robot="ur5e")
    assert scene.attached == (TOOL,)
    assert "attached: tool" in repr(scene)
    assert scene.replace(attached=None).robot is ROBOTS["ur5e"].with_links(True)


WEDGE = pr.Attached("wedge", link="base", points=[[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3]])
BALL = pr.Attached("ball", link="forearm", start=[0.2, 0, 0.1], end=[0.2, 0, 0.1], radius=0.05)


@pytest.mark.parametrize("kind", ["urdf", "mjcf", "glb"])
def test_exports_carry_what_is_attached_where_it_is(kind, tmp_path):
    scene = pr.Scene(robot="ur5e", attached=[TOOL, WEDGE, BALL])
    pr.export("n1_4_0", scene, to=kind, folder=tmp_path)
    robot, q = scene.robot, scene.poses[0].q
    bodies = carried_polyhedra(robot, q)
    if kind == "mjcf":
        model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        for i, (carried, body) in enumerate(zip(robot.carried, bodies, strict=True)):
            geom = model.geom(f"attached_{i}_{carried.name}").id
            assert body(data.geom_xpos[geom]) < 0
        assert model.geom("ball").id >= 0
    elif kind == "glb":
        made = trimesh.load(tmp_path / "scene.glb")
        names = set(made.graph.nodes)
        assert {"attached_0", "attached_1", "body_ball"} <= names
    else:
        arm = yourdfpy.URDF.load(str(tmp_path / "robot.urdf"), load_collision_meshes=True)
        arm.update_cfg(dict(zip(arm.actuated_joint_names, q, strict=True)))
        meshes = arm.scene.dump()
        for body in bodies:
            corners = np.unique(np.round(body.edges.reshape(-1, 3), 6), axis=0)
            off = [
                np.abs(mesh.vertices[:, None] - corners[None]).max(axis=2).min(axis=0).max()
                for mesh in meshes
            ]
            assert min(off) < 1e-5


def test_the_page_in_the_browser_shows_what_is_attached():
    scene = pr.Scene(robot="ur5e", attached=[TOOL, BALL])
    drawing = Drawing(QuickEstimate(scene, [NEAR], points=300))
    parts = drawing.backdrop(DrawnParts(0, NEAR, "shadow"))
    corners = carried_polyhedra(scene.robot, scene.poses[0].q)[0].edges.reshape(-1, 3)
    assert np.ptp(parts["attached0"].vertices, axis=0) == pytest.approx(np.ptp(corners, axis=0))
    assert "attached0" not in drawing.backdrop(DrawnParts(0, NEAR, "shadow", robot=False))


def test_expected_readings_are_those_of_an_obstacle_where_the_tool_stands():
    tool = pr.Attached("tool", link="forearm", centre=[0.2, 0, 0.2], size=[0.05, 0.3, 0.2])
    scene, setup = pr.Scene(attached=[tool]), Setup((Ring("forearm", 0.2, 6, radius=0.09),))
    poses = np.stack([scene.poses[0].q, scene.poses[0].q + 0.3])
    read = expected(scene, setup, np.concatenate([poses, poses[:1]]))
    assert np.isfinite(read.distance[0]).any()
    np.testing.assert_array_equal(read.distance[0], read.distance[2])
    bare = pr.Scene()
    for q, distance in zip(poses, read.distance, strict=False):
        stands = Obstacle("tool", carried_polyhedra(scene.robot, q)[0])
        other = expected(replace(bare, obstacles=(stands,)), setup, q[None])
        np.testing.assert_allclose(distance, other.distance[0], atol=1e-9)
