"""Robots that are built in: kinematics by MuJoCo, by published tables and by public URDFs; limits,
mounts and bodies.
"""

import math
import sysconfig
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.cli.options.scenes import resolve_scene
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.robots.built_in import PAPER_ROBOTS, ROBOTS, built_in
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.capsules import gap_to_capsules
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.posed_robot import Shape, robot_curve
from place_rings.coverage.targets.solid import target_solid
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.objectives.scene import REFERENCE_POSE_DEG
from scipy.spatial.transform import Rotation

from ..strategies.rings import poses
from ..support import drawing
from ..support.urdf_text import Peer, chain_text

FK = 1e-9  # m, and of rotation matrices
PUBLIC = Path(sysconfig.get_paths()["purelib"], "cmeel.prefix/share/example-robot-data/robots")
if not PUBLIC.exists():  # beside the package that is tested
    import importlib.util

    spec = importlib.util.find_spec("jax")
    PUBLIC = (
        Path(str(spec and spec.origin)).parents[1] / "cmeel.prefix/share/example-robot-data/robots"
    )
UR_LINKS = [
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
]
URDFS = {
    "ur3": ("ur_description/urdf/ur3_robot.urdf", UR_LINKS, "base_link"),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", UR_LINKS, "base_link"),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", UR_LINKS, "base_link"),
    "panda": (
        "panda_description/urdf/panda.urdf",
        [f"panda_link{i}" for i in range(1, 9)],
        "panda_link0",
    ),
}
# Published Denavit-Hartenberg tables: (d, a, alpha in degrees) of each joint. Universal Robots'
# pages on the parameters, and KUKA's dimensions of the R820.
UR_TABLES = {
    "ur3": (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819),
    "ur5": (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
    "ur10": (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
    "ur3e": (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    "ur5e": (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    "ur10e": (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
    "ur16e": (0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655),
    "ur20": (0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543),
}
IIWA = [
    (0.36, 0, -90),
    (0, 0, 90),
    (0.42, 0, 90),
    (0, 0, -90),
    (0.4, 0, -90),
    (0, 0, 90),
    (0.126, 0, 0),
]
# Franka's modified (Craig's) table: (a, d, alpha in degrees) before each joint.
FRANKA = [
    (0, 0.333, 0),
    (0, 0, -90),
    (0, 0.316, 90),
    (0.0825, 0, 90),
    (-0.0825, 0.384, -90),
    (0, 0, 90),
    (0.088, 0, 90),
]


def turn(axis, angle):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return T


def shift(x, z):
    T = np.eye(4)
    T[0, 3], T[2, 3] = x, z
    return T


def by_table(q, table):
    T = np.eye(4)
    for theta, (d, a, alpha) in zip(q, table, strict=True):
        T = T @ turn("z", theta) @ shift(a, d) @ turn("x", math.radians(alpha))
    return T


@pytest.mark.parametrize("name", ROBOTS)
def test_kinematics_are_mujocos(name):
    chain, rng = ROBOTS[name].chain, np.random.default_rng(1)
    peer = Peer(chain_text(chain))
    for _ in range(10):
        q = drawing.pose(rng, len(chain))
        frames = forward(chain, q)
        angles = dict(zip(chain.joints, q, strict=True))
        for j, T in enumerate(frames):
            link = "tip" if j == len(chain) else f"link_{j}"
            assert np.abs(T - peer.pose(angles, link, "base")).max() < FK


@settings(max_examples=20)
@given(poses(), st.sampled_from(sorted(UR_TABLES)))
def test_universal_robots_are_their_published_tables(q, name):
    """The base frame of the description is the table's turned by half a turn; the UR10's URDF is
    rounded to 0.1 mm.
    """
    d1, a2, a3, d4, d5, d6 = UR_TABLES[name]
    wanted = by_table(
        q, [(d1, 0, 90), (0, a2, 0), (0, a3, 0), (d4, 0, 90), (d5, 0, -90), (d6, 0, 0)]
    )
    found = forward(ROBOTS[name].chain, q)[-1]
    assert np.abs(found[:3, 3] - (turn("z", math.pi) @ wanted)[:3, 3]).max() < (
        1e-4 if name == "ur10" else FK
    )
    outward = ROBOTS[name].mounts[-1].axis
    assert np.abs(found[:3, :3] @ outward - (turn("z", math.pi) @ wanted)[:3, 2]).max() < FK


@settings(max_examples=20)
@given(poses(7))
def test_arms_of_seven_joints_are_their_published_tables(q):
    T = np.eye(4)
    for theta, (a, d, alpha) in zip(q, FRANKA, strict=True):
        T = T @ turn("x", math.radians(alpha)) @ shift(a, 0) @ turn("z", theta) @ shift(0, d)
    for name in ("panda", "fr3"):
        assert np.abs(forward(ROBOTS[name].chain, q)[-1] - T @ shift(0, 0.107)).max() < FK
    assert np.abs(forward(ROBOTS["iiwa14"].chain, q)[-1] - by_table(q, IIWA)).max() < FK


@pytest.mark.skipif(not PUBLIC.exists(), reason="needs the [robots] extra")
@pytest.mark.parametrize("name", URDFS)
def test_kinematics_are_those_of_the_public_urdf(name):
    """Every joint's frame, by MuJoCo's reading of the file; where a file writes half a turn with 12
    digits, as it is.
    """
    file, links, base = URDFS[name]
    chain, rng = ROBOTS[name].chain, np.random.default_rng(2)
    text = (PUBLIC / file).read_text()
    peer = Peer(text)
    for _ in range(10):
        q = drawing.pose(rng, len(chain))
        names = chain.joints if name == "panda" else [f"{j}_joint" for j in chain.joints]
        frames = forward(chain, q)
        for T, link in zip(frames, links, strict=False):
            assert np.abs(T - peer.pose(dict(zip(names, q, strict=True)), link, base)).max() < FK, (
                link
            )


def test_what_is_built_in_is_sound():
    assert tuple(ROBOTS)[:2] == PAPER_ROBOTS
    assert len({id(r) for r in ROBOTS.values()}) == len(ROBOTS)
    for name, robot in ROBOTS.items():
        assert robot.name == name
        assert robot.source
        assert built_in(robot)
        n = len(robot.chain)
        assert robot.limits.shape == (n, 2)
        assert np.all(robot.limits[:, 0] < robot.limits[:, 1])
        assert np.all((robot.limits[:, 0] <= robot.rest) & (robot.rest <= robot.limits[:, 1]))
        assert {"upper_arm", "forearm", "tool"} <= set(robot.links)
        for m in (*robot.mounts, *robot.with_links(True).mounts):
            assert 0 <= m.frame <= n
            assert np.allclose(
                [m.axis @ m.axis, m.zero @ m.zero, m.axis @ m.zero], [1, 1, 0], atol=1e-9
            )
            assert 0 <= m.usable[0] < m.usable[1] <= 1
            assert m.length == 0 or m.length * (m.usable[1] - m.usable[0]) > 0.07
        real = robot.with_links(True)
        assert built_in(real)
        assert built_in(real.with_links(False))
        assert not built_in(replace(robot, bodies=()))
        assert all(0.02 < m.section < 0.1 for m in real.mounts)
        assert all(-1 <= b.frame < n and 0.005 < b.capsule.radius < 0.15 for b in robot.bodies)
    assert np.allclose(ROBOTS["ur10"].rest, np.radians(REFERENCE_POSE_DEG))


def test_the_fr3_has_limits_of_the_maker_and_says_which():
    """franka_description's fr3/joint_limits.yaml. The maker's later system limits (frankarobotics/
    docs, control-parameters-joint-fr3.csv) contain them; the ranges that it suggests to planners
    (-rectangular.csv, and those of an earlier edition) lie within them.
    """
    symmetric = {1: 2.7437, 2: 1.7837, 3: 2.9007, 5: 2.8065, 7: 3.0159}
    system = {1: 2.9007, 2: 1.8361, 3: 2.9007, 5: 2.8763, 7: 3.0508}
    planner = {1: 2.3476, 2: 1.5454, 3: 2.4937, 5: 2.5100, 7: 2.7045}
    earlier = {1: 2.3093, 2: 1.5133, 3: 2.4937, 5: 2.4800, 7: 2.6895}

    def limits(of, fourth, sixth):
        rows = {j: (-v, v) for j, v in of.items()} | {4: fourth, 6: sixth}
        return np.array([rows[j] for j in range(1, 8)])

    own = ROBOTS["fr3"].limits
    assert np.array_equal(own, limits(symmetric, (-3.0421, -0.1518), (0.5445, 4.5169)))
    wide = limits(system, (-3.0770, -0.1169), (0.4398, 4.6216))
    assert np.all((wide[:, 0] <= own[:, 0]) & (own[:, 1] <= wide[:, 1]))
    for narrow in (
        limits(planner, (-2.7714, -0.4226), (0.7773, 4.2841)),
        limits(earlier, (-2.7478, -0.4461), (0.8521, 4.2094)),
    ):
        assert np.all((own[:, 0] <= narrow[:, 0]) & (narrow[:, 1] <= own[:, 1]))


FRAGMENT = 0.0775  # m: a fragment of 1 mm lies beside the UR10's upper arm in its visual mesh


@pytest.mark.skipif(not PUBLIC.exists(), reason="needs the [robots] extra")
@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_bodies_contain_the_public_meshes(name):
    """Every point of the visual meshes is at least 0.1 mm inside a capsule of its link; the
    capsules exceed the mesh by 4 cm at most on average."""
    file, links, base = URDFS[name]
    path, robot = PUBLIC / file, ROBOTS[name].with_links(True)
    picked = pick_chain(read_urdf(path), base, links[-1])
    meshes, rng = Meshes(path, (PUBLIC.parent.parent,)), np.random.default_rng(0)
    for carried in picked.carried:
        bodies = [b.capsule for b in robot.bodies if b.frame == carried.frame]
        surface = meshes.surface(carried, "visual")
        if not len(surface) or not bodies or "hand" in carried.link.name or carried.beside:
            continue
        surface = surface[surface[:, :, 0].min(axis=1) > (-FRAGMENT if name == "ur10" else -1)]
        weights = rng.dirichlet(np.ones(3), (4, len(surface)))
        points = np.concatenate(
            [surface.reshape(-1, 3), *np.einsum("ktc,tcx->ktx", weights, surface)]
        )
        if carried.link.name == "wrist_3_link":  # as the maker moved it in 2026
            points = np.concatenate([points, points - [0, 0, 1e-3 * (name == "ur10")]])
        outside = np.min([b.distance(points) for b in bodies], axis=0)
        assert outside.max() < -1e-4, carried.link.name
        assert np.median(outside) > -0.04, carried.link.name


# Corners of the maker's meshes of wrist 3 (commit 2221ec0) that lie least deep in its capsule, in
# the joint's frame, mm; and by how far the maker moved the mesh along z in 2026, mm:
# https://github.com/UniversalRobots/Universal_Robots_ROS2_Description/pull/393 (issue 139; the UR3
# by 2.55 mm before, in pull request 258)
WRIST_3 = {
    "ur3": (0.55, [[31.67, 40.55, -4.87], [31.34, 79.35, -6.85], [-11.1, 40.55, -32.11],
                   [-11.39, 79.35, -31.83], [-30.29, 40.55, 8.09], [29.0, 40.55, 11.1]]),
    "ur5e": (0.5, [[-37.55, 53.85, -3.11], [-36.65, 90.6, 7.63], [37.32, 90.6, -4.74],
                   [-0.78, 65.14, 43.34], [-12.18, 90.61, -36.18], [12.5, 53.85, -36.07]]),
    "ur10": (-1.0, [[-44.96, 61.59, -0.87], [44.97, 78.59, -0.74], [-19.23, 78.57, 41.73],
                   [-4.26, 61.59, 45.8], [0.0, 78.59, -44.0], [13.14, 61.59, -42.04]]),
    "ur10e": (0.5, [[44.84, 67.7, -4.98], [-0.19, 78.8, 51.07], [-44.81, 107.45, -5.26],
                    [15.0, 67.7, -43.14], [-27.5, 107.46, -36.37], [41.89, 107.46, -17.44]]),
}  # fmt: skip
WRIST_3["ur16e"] = WRIST_3["ur10e"]


@pytest.mark.parametrize("name", WRIST_3)
def test_wrist_3_contains_its_mesh_where_the_maker_moved_it(name):
    """Across the joint's axis, and as far along it, either way."""
    moved, corners = WRIST_3[name]
    (body,) = (b.capsule for b in ROBOTS[name].with_links(True).bodies if b.frame == 5)
    moves = [moved * np.array([0, y, z]) for y, z in ((0, 0), (1, 0), (-1, 0), (0, 1))]
    if name == "ur3":
        moves.append(np.array([0, 0, 2.55]))
    for move in moves:
        assert body.distance((np.array(corners) + move) / 1000).max() < -2e-4


@settings(max_examples=10)
@given(drawing.seeds)
def test_both_readings_of_the_ur10_are_one_arm(seed):
    """At equal joint angles their bodies and tubes are the same, half a turn apart at the base."""
    q = np.random.default_rng(seed).uniform(-math.pi, math.pi, 6)
    half_turn, places = np.diag([-1.0, -1.0, 1.0]), []
    for name, turn in (("ur10", np.eye(3)), ("ur10_dh", half_turn)):
        robot = ROBOTS[name].with_links(True)
        frames = forward(robot.chain, q)
        bodies = robot_capsules(robot, frames)
        ends = [bodies.start, bodies.end]
        for m in robot.mounts:
            T = frames[m.frame]
            ends += [T[:3, :3] @ m.start + T[:3, 3], T[:3, :3] @ m.axis, T[:3, :3] @ m.zero]
        places.append(np.concatenate([np.atleast_2d(e) @ turn for e in ends]))
    assert np.allclose(*places, atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_real_mount_runs_along_its_tube(name):
    """A capsule of the link lies on the axis of each mount with a length, along all of it, and is
    hardly thicker than the section."""
    robot = ROBOTS[name].with_links(True)
    for m in robot.mounts:
        if m.length == 0:
            continue
        fits = []
        for b in robot.bodies:
            ends = np.stack([b.capsule.start, b.capsule.end]) - m.start
            off = np.linalg.norm(np.cross(ends, m.axis), axis=1).max()
            along = sorted(ends @ m.axis)
            fits.append(
                b.frame == m.frame
                and off < 1e-3
                and along[0] < 1e-3
                and along[1] > m.length - 1e-3
                and abs(b.capsule.radius - m.section) < 2e-3
            )
        assert sum(fits) == 1, m.link


@pytest.mark.parametrize("name", ROBOTS)
def test_a_ring_around_a_mount_is_clear_of_the_robots_bodies(name):
    """A circle 3.5 cm outside the section stands in no body but those that contain the tube's own
    link, in any of the positions; the axis itself runs inside the body."""
    robot = ROBOTS[name].with_links(True)
    frames = forward(robot.chain, robot.rest)
    bodies = robot_capsules(robot, frames)
    turn = np.linspace(0, 2 * math.pi, 48)[:, None]
    for m in robot.mounts[:-1]:
        T = frames[m.frame]
        for t in (0.1, 0.5, 0.9):
            centre = m.start + t * m.length * m.axis
            circle = centre + (m.section + 0.035) * (np.cos(turn) * m.zero + np.sin(turn) * m.side)
            gap = gap_to_capsules(
                circle @ T[:3, :3].T + T[:3, 3], bodies.start, bodies.end, bodies.radius
            )
            assert np.median(gap) > 0, (m.link, t)
            inside = gap_to_capsules(
                (T[:3, :3] @ centre + T[:3, 3])[None], bodies.start, bodies.end, bodies.radius
            )
            assert inside[0] < 0, (m.link, t)


@pytest.mark.parametrize("name", ROBOTS)
def test_targets_of_every_robot(name):
    """The pose curve runs from the base to the TCP, also where joints' origins coincide, and the
    shell has a volume.
    """
    robot = ROBOTS[name]
    curve = robot_curve(robot, robot.rest, Shape())
    assert 0.9 < curve.arc_length() < 2.5
    ends = curve.pieces[0].control[0], curve.pieces[-1].control[-1]
    assert np.allclose(ends[0], 0)
    assert np.allclose(ends[1], forward(robot.chain, robot.rest)[-1, :3, 3])
    solid = target_solid(Shell(0.5), robot, robot.rest)
    p = np.random.default_rng(0).uniform(-1.5, 1.5, (2000, 3))
    assert (solid(p) <= 0).any()


def test_a_scene_is_read_for_the_robot_that_is_given(tmp_path):
    """Poses, mounts and limits of a file are judged by ``--robot``, not by the file's own robot."""
    path = tmp_path / "cell.toml"
    path.write_text("[[poses]]\nq_deg = [0.0, 20.0, 0.0, -80.0, 0.0, 100.0, 40.0]\n")
    scene = resolve_scene(path, "panda")
    assert scene.robot is ROBOTS["panda"]
    assert np.degrees(scene.poses[0].q) == pytest.approx([0, 20, 0, -80, 0, 100, 40])
    with pytest.raises(UserError, match=r"cell\.toml: .*q_deg\b.* 7\b.* 6\b.* ur5e"):
        resolve_scene(path, "ur5e")
    path.write_text("[[poses]]\nq_deg = [0.0, 20.0, 0.0, 80.0, 0.0, 100.0, 40.0]\n")
    with pytest.raises(UserError, match=r"cell\.toml: .*q_deg\[3\].* 80\.0\b.* panda"):
        resolve_scene(path, "panda")


def test_a_scene_at_its_robots_rest_moves_to_the_rest_of_the_one_given(tmp_path):
    path = tmp_path / "cell.toml"
    rest = [math.degrees(a) for a in ROBOTS["fr3"].rest]
    path.write_text(f'robot = "fr3"\n[[poses]]\nq_deg = {rest}\n')
    for name in ("panda", "ur5e", "iiwa14"):
        scene = resolve_scene(path, name)
        assert scene.robot.name == name
        assert scene.poses[0].q == pytest.approx(ROBOTS[name].rest)
