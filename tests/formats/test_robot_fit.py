"""Fitting: capsules contain what they stand for and are tight, tubes are found where they are,
files read back.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.solids.capsules import Capsules
from place_rings.formats.loader import read_proposal, read_robot, read_scene
from place_rings.formats.robots.capsule_fit import enclosing, fit_capsules, union_volume
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.mount_axes import confidence
from place_rings.formats.robots.mount_detection import find_tube
from place_rings.formats.robots.urdf_model import UrdfShape
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from scipy.spatial.transform import Rotation

from ..support import drawing
from ..support.refusals import has_parts, refused
from ..support.scene_tables import scene_table, scene_toml


def turned(mesh, rng):
    """Triangles of a mesh, turned and carried anywhere, and how."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = (
        Rotation.random(random_state=int(rng.integers(2**31))).as_matrix(),
        rng.uniform(-1, 1, 3),
    )
    return np.array(mesh.triangles) @ T[:3, :3].T + T[:3, 3], T


def link(rng, sections=32):
    """A tube with a housing across at either end, as arms have: triangles in the frame whose z is
    the tube's axis.
    """
    radius = rng.uniform(0.03, 0.06)
    length = radius * rng.uniform(8, 12)
    house = 1.6 * radius
    tube = trimesh.creation.cylinder(radius, length, sections=sections)
    ends = [trimesh.creation.cylinder(house, 3 * radius, sections=sections) for _ in range(2)]
    for end, z in zip(ends, (-length / 2, length / 2), strict=True):
        end.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, [1, 0, 0]))
        end.apply_translation([0, 0, z])
    return trimesh.util.concatenate([tube, *ends]), radius, length - 2 * house


@settings(max_examples=3)
@given(drawing.seeds, st.integers(1, 4))
def test_capsules_contain_the_surface(seed, most):
    """Every vertex, and every point of every triangle between."""
    rng = np.random.default_rng(seed)
    soup = rng.normal(size=(int(rng.integers(1, 40)), 3, 3)) * rng.uniform(0.01, 0.3, 3)
    capsules = fit_capsules(soup, most=most)
    assert 1 <= len(capsules) <= most
    w = rng.dirichlet(np.ones(3), (len(soup), 50))
    points = np.concatenate(
        [soup.reshape(-1, 3), np.einsum("tnk,tkd->tnd", w, soup).reshape(-1, 3)]
    )
    assert np.max([-c.distance(points) for c in capsules], axis=0).min() > -1e-9


@settings(max_examples=8)
@given(drawing.seeds)
def test_points_on_a_capsule_get_it_back(seed):
    rng = np.random.default_rng(seed)
    made = trimesh.creation.capsule(rng.uniform(0.05, 0.5), rng.uniform(0.03, 0.1), count=[16, 24])
    triangles, _ = turned(made, rng)
    found = enclosing(triangles.reshape(-1, 3))
    assert -found.distance(triangles.reshape(-1, 3)).max() > -1e-9
    assert found.volume < 1.03 * made.volume


def test_a_capsule_of_few_points_is_what_it_must_be():
    one = enclosing(np.array([[1.0, 2, 3]]))
    assert one.volume < 1e-12
    two = enclosing(np.array([[0.0, 0, 0], [0, 0, 1]]))
    assert two.volume < 1e-6
    cross = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    assert enclosing(cross).volume < 1.02 * 4 / 3 * math.pi


@pytest.mark.parametrize("seed", range(2))
def test_an_arm_takes_a_few_tight_capsules(seed):
    rng = np.random.default_rng(seed)
    mesh, _, _ = link(rng)
    triangles, _ = turned(mesh, rng)
    one, three = (fit_capsules(triangles, most=n) for n in (1, 3))
    assert len(three) == 3
    assert union_volume(three) < 0.8 * union_volume(one)
    assert np.max([-c.distance(triangles.reshape(-1, 3)) for c in three], axis=0).min() > -1e-9


def test_many_corners_lie_in_capsules_that_are_fitted_to_a_sample():
    """A ball of 12,000 triangles: a sphere around it, and nothing outside."""
    i = np.arange(6000) + 0.5
    z, turn = 1 - i / 3000, np.pi * (1 + 5**0.5) * i
    r = 0.2 * np.sqrt(1 - z**2)
    ball = trimesh.convex.convex_hull(np.stack([r * np.cos(turn), r * np.sin(turn), 0.2 * z], 1))
    capsules = fit_capsules(np.array(ball.triangles), most=1)
    assert min(float(c.distance(ball.vertices).max()) for c in capsules) <= 0
    assert sum(c.volume for c in capsules) < 1.02 * 4 / 3 * np.pi * 0.2**3


def test_volume_of_a_union():
    a = Capsules(np.zeros(3), np.array([0.0, 0, 1]), 0.2)
    assert union_volume([a]) == pytest.approx(a.volume, rel=0.01)
    assert union_volume([a, a]) == pytest.approx(a.volume, rel=0.01)


@settings(max_examples=4)
@given(drawing.seeds)
def test_the_tube_of_a_link_is_found(seed):
    """Its axis, its radius, and its clear stretch between the housings, whose round sides leave it
    a little longer.
    """
    rng = np.random.default_rng(seed)
    mesh, radius, clear = link(rng)
    triangles, T = turned(mesh, rng)
    rough = T[:3, 2] + rng.normal(size=3) * 0.03
    tube = find_tube(triangles, [rough / np.linalg.norm(rough)])
    assert abs(tube.axis @ T[:3, 2]) > 1 - 1e-4
    assert tube.radius == pytest.approx(radius, rel=0.08)
    assert clear - 0.03 < tube.length < clear + radius
    for end in (tube.start, tube.end):
        v = end - T[:3, 3]
        assert np.linalg.norm(v - (v @ T[:3, 2]) * T[:3, 2]) < 0.002


@pytest.mark.parametrize(
    ("radius", "thicker", "apart"), [(0.02, 1.3, 0.2), (0.04, 1.75, 0.15), (0.05, 1.5, 0.3)]
)
def test_a_stretch_ends_where_the_housings_begin(radius, thicker, apart):
    """Balls about the ends of a tube: the closed form of where they leave it."""
    tube = trimesh.creation.cylinder(radius, 2 * apart, sections=96)
    ball = trimesh.creation.icosphere(4, thicker * radius)
    housings = [ball.copy().apply_translation([0, 0, sign * apart]) for sign in (-1, 1)]
    half = apart - radius * math.sqrt(thicker**2 - 1)
    found = find_tube(
        np.array(trimesh.util.concatenate([tube, *housings]).triangles), [np.eye(3)[2]]
    )
    ends = sorted((found.start[2], found.end[2]))
    assert ends == pytest.approx([-half, half], abs=0.02 * apart + 0.02 * radius)
    # the housings' surface, and not only their sections, stays beyond the ends
    points = np.concatenate([h.sample(4000) for h in housings])
    inside = (points[:, 2] > ends[0]) & (points[:, 2] < ends[1])
    assert np.all(np.hypot(points[inside, 0], points[inside, 1]) < 1.011 * found.radius)
    assert found.round == 1.0
    assert confidence(found, "mesh")[0] == "high"
    assert confidence(found, "collision mesh")[0] == "medium"
    assert confidence(found, "primitive shape")[0] == "medium"


@pytest.mark.parametrize("flat", [0.6, 0.92, 0.96])
def test_an_oval_tube_has_a_low_confidence(flat):
    """A tube is round if its widths differ by 6 % at most."""
    tube = trimesh.creation.cylinder(0.04, 0.3, sections=256)
    tube.apply_transform(np.diag([1.0, flat, 1.0, 1.0]))
    found = find_tube(np.array(tube.triangles), [np.eye(3)[2]])
    assert found.radius == pytest.approx(0.04, rel=0.03)
    assert found.length == pytest.approx(0.3, abs=0.01)
    assert found.round == float(flat >= 0.94)
    level, basis = confidence(found, "mesh")
    assert level == ("high" if found.round else "low")
    assert f"{100 * found.round:.0f} %" in basis


def test_a_ball_and_a_disc_are_no_tubes():
    for mesh in (trimesh.creation.icosphere(3, 0.1), trimesh.creation.cylinder(0.1, 0.05)):
        assert find_tube(np.array(mesh.triangles), list(np.eye(3))) is None


@pytest.mark.parametrize(
    ("shape", "inside", "outside"),
    [
        (UrdfShape("box", np.eye(4), (0.2, 0.4, 0.6)), [0.1, 0.2, 0.3], [0.11, 0, 0]),
        (UrdfShape("sphere", np.eye(4), (0.2,)), [0, 0, 0.2], [0, 0, 0.21]),
        (UrdfShape("cylinder", np.eye(4), (0.1, 0.6)), [0.1, 0, 0.3], [0, 0, 0.31]),
        (UrdfShape("capsule", np.eye(4), (0.1, 0.6)), [0, 0, 0.4], [0, 0, 0.41]),
    ],
)
def test_plain_shapes_are_where_they_should_be(tmp_path, shape, inside, outside):
    """The polyhedron contains the shape and hardly more."""
    made = Meshes(tmp_path / "r.urdf").shape(shape, "b").reshape(-1, 3)
    hull = trimesh.convex.convex_hull(made)
    planes, origins = hull.face_normals, hull.triangles[:, 0]

    def depth(p):
        return -np.max(np.einsum("nd,nd->n", planes, np.array(p) - origins))

    assert depth(inside) > -1e-9
    assert depth(outside) < 0


def test_a_scene_holds_its_robot_or_names_its_file(tmp_path):
    mine = replace(ROBOTS["panda"], name="mine")
    scene = Scene(robot=mine, poses=(Pose(mine.rest),))
    (tmp_path / "inline.toml").write_text(scene_toml(scene))
    (tmp_path / "mine.toml").write_text(to_toml(mine, file=RobotFile))
    (tmp_path / "named.toml").write_text('robot = "mine.toml"\n')
    (tmp_path / "proposal.toml").write_text(
        "version = 2\n[[rings]]\nlink = 'forearm'\ncount = 8\n[scene]\nrobot = 'mine.toml'\n"
    )
    inline, named = (read_scene(tmp_path / f"{n}.toml") for n in ("inline", "named"))
    proposed = read_proposal(tmp_path / "proposal.toml")[1]
    wanted = scene_table(scene)
    assert all(scene_table(s) == wanted for s in (inline, named, proposed))
    assert len(named.poses[0].q) == 7
    assert scene_table(Scene("panda"))["robot"] == "panda"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("robot = '../mine.toml'", 'robot "../mine.toml"'),
        ("robot = '/etc/mine.toml'", 'robot "/etc/mine.toml"'),
        ("robot = 'nothing.toml'", "nothing.toml"),
        ("robot = 'arm.urdf'", 'robot "arm.urdf"'),
        ("[robot]\nname = 'x'", "robot.reach"),
        ("[robot]\nname = 'x'\nreach = 1\njoints = 3", "robot.joints 3"),
        ("robot = 'panda'\n[[poses]]\nq_deg = [0, 0, 0, 0, 0, 0]", "poses[0].q_deg 6 7 panda"),
        (
            "robot = 'panda'\n[[poses]]\nq_deg = [0, 0, 0, 0, 0, 9, 0]",
            "poses[0].q_deg[3] 0.0 panda",
        ),
        ("[[poses]]\nq_deg = [0, 0, 181, 0, 0, 0]", "poses[0].q_deg[2] -180 180 elbow ur10"),
    ],
)
def test_a_scene_with_a_bad_robot_is_one_line(tmp_path, text, parts):
    (tmp_path / "scene.toml").write_text(text)
    with refused(parts):
        read_scene(tmp_path / "scene.toml")


AXIS = "axis = [0.0, 0.0, 1.0]"
BAD_FILES = {
    (AXIS, "axis = [0.0, 0.0, 2.0]"): "joints[0].axis[2] 2.0",
    (AXIS, "axis = [0.0, 0.5, 0.5]"): "joints[0].axis [0.0, 0.5, 0.5]",
    ('frame = "elbow"', 'frame = "knee"'): 'mounts[1].frame "knee" shoulder_pan',
    ("limits_deg = [-360.0, 360.0]", "limits_deg = [360.0, -360.0]"): "joints[0].limits_deg",
    ("radius = 0.075", "radius = -1.0"): "bodies[0].radius -1.0",
    ("reach = 1.3", "reach = nan"): "reach nan",
    ('name = "elbow"', 'name = "shoulder_lift"'): "joints[2].name",
}


@pytest.mark.parametrize(("change", "parts"), BAD_FILES.items())
def test_a_bad_robot_file_is_one_line(tmp_path, change, parts):
    text = to_toml(UR10, file=RobotFile)
    text = text.replace("\n    ", " ").replace(",\n]", "]").replace("[ ", "[")
    assert change[0] in text
    (tmp_path / "r.toml").write_text(text.replace(*change, 1))
    with refused(f"r.toml {parts}"):
        read_robot(tmp_path / "r.toml")


def test_a_tube_beside_its_mount_is_refused_in_one_line(tmp_path):
    """Files of earlier versions may shift the tube from the mount axis, and often do so by 0."""
    text = to_toml(UR10, file=RobotFile)
    for aside, toward in (("0.0", "30.0"), ("0.046", "-90.0")):
        keys = f'link = "upper_arm"\naside = {aside}\ntoward_deg = {toward}'
        (tmp_path / "r.toml").write_text(text.replace('link = "upper_arm"', keys))
        if aside == "0.0":
            with pytest.warns(DeprecationWarning, match="aside|toward"):
                assert read_robot(tmp_path / "r.toml").mount("upper_arm").section == 0.0547
            continue
        with refused("r.toml mounts[0].aside 0.046"):
            read_robot(tmp_path / "r.toml")


def test_from_a_urdf_to_a_scene(run, tmp_path):
    """The command on an arm of two links with meshes: files, a picture, a mount on each link, and a
    scene that counts.
    """
    mesh, radius, _ = link(np.random.default_rng(3), 12)
    mesh.apply_translation([0, 0, 0.25])
    mesh.export(tmp_path / "link.stl")
    body = "<collision><geometry><mesh filename='link.stl'/></geometry></collision>"
    text = "<robot name='two'><link name='base'/>"
    for kind, parent, child, at, shape in (
        ("continuous", "base", "link_0", 0.1, body),
        ("continuous", "link_0", "link_1", 0.6, body),
        ("fixed", "link_1", "tip", 0.5, ""),
    ):
        text += f"<link name='{child}'>{shape}</link><joint name='to_{child}' type='{kind}'>"
        text += f"<parent link='{parent}'/><child link='{child}'/><axis xyz='0 1 0'/>"
        text += f"<origin xyz='0 0 {at}'/></joint>"
    (tmp_path / "two.urdf").write_text(f"{text}</robot>")
    out = tmp_path / "out"
    code, printed, _ = run("robot", "two.urdf", "--out", out)
    assert code == 0
    assert "link_0" in printed
    robot = read_scene(out / "scene.toml").robot
    assert robot.links == ("link_0", "link_1", "tool")
    for mount in robot.mounts[:2]:
        assert abs(mount.axis[2]) > 0.999
        assert mount.section == pytest.approx(radius, rel=0.1)
    assert read_scene(out / "scene.toml").ring_radius > max(m.section for m in robot.mounts)
    # the meshes are stated for collision only
    assert [m.confidence for m in robot.mounts] == ["medium", "medium", "low"]
    assert (out / "robot.png").stat().st_size > 10_000
    for frame in (0, 1):
        capsules = [b.capsule for b in robot.bodies if b.frame == frame]
        assert np.max([-c.distance(mesh.vertices) for c in capsules], axis=0).min() > -1e-9
    ring = "[[rings]]\nlink = 'link_1'\nposition = 0.5\ncount = 8\n"
    (tmp_path / "p.toml").write_text(ring)
    # the reference scene's robot has no such link
    code, _, err = run("verify", "p.toml", "--voxel", "0.1")
    assert code == 2
    assert has_parts(err, 'p.toml rings[0].link "link_1" ur10')
    (tmp_path / "p.toml").write_text(ring + "[scene]\nrobot = 'out/robot.toml'\n")
    code, printed, _ = run("verify", "p.toml", "--voxel", "0.1", "--json")
    assert code == 0
    assert "zeta_percent" in json.loads(printed)
    code, printed, _ = run("cones", "p.toml", "--robot", out / "robot.toml")
    assert code == 0
    assert len(printed.splitlines()) == 9
    code, _, err = run("verify", "n1_8_0", "--robot", out / "robot.toml")
    assert code == 2
    assert has_parts(err, "two link_0, link_1, tool")
