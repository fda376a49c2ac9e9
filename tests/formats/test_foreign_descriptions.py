"""Robot descriptions as they lie in public repositories: left-over xacro, merge conflicts, pointers
of Git LFS, addresses of other machines. Each loads or is one line that helps."""

import io
import time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.cli.runs.robot import ring_radii, scene_text
from place_rings.coverage.rings.ring import Setup
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.loader import read_scene
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.packages import Packages
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_options import UrdfOptions
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.stand_ins import refuse_stand_in
from place_rings.formats.writing import to_toml
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.space.feasible_set import FeasibleSet
from place_rings.reporting.export_formats import FORMATS

from ..support.refusals import has_parts, refused

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
LINES = [
    '<robot name="arm" {xacro}>',
    '<link name="base"/>',
    '<link name="upper"><collision><origin xyz="0 0 {z}"/><geometry>',
    '<cylinder radius="{r}" length="0.4"/></geometry></collision></link>',
    '<link name="{tip}"/>',
    '<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>',
    '<axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>',
    '<joint name="end" type="fixed"><parent link="upper"/><child link="{tip}"/>',
    '<origin xyz="0 0 0.4"/></joint>',
    "</robot>",
]
PLAIN = {"xacro": "", "z": "0.2", "r": "0.05", "tip": "tool0"}
words = st.text("abcxyz_", min_size=1, max_size=8)


def text(**parts):
    return "\n".join(LINES).format(**(PLAIN | parts))


def bodies(path):
    return [repr(body) for body in UrdfOptions().fit(path).robot.bodies]


def content(path):
    """Links and joints of a file, as text."""
    urdf = read_urdf(path)
    return repr((urdf.name, urdf.links, urdf.joints))


# elephantrobotics/mycobot_ros: 87 of 91 URDFs have a property that nothing uses
@settings(max_examples=12)
@given(words, words, st.sampled_from(["property", "arg", "macro"]), st.booleans())
def test_left_over_definitions_of_xacro_change_nothing(tmp_path_factory, name, value, kind, first):
    folder = tmp_path_factory.mktemp("xacro")
    left = f'<xacro:{kind} name="{name}" value="${{{value}}}"/>'
    whole = text(xacro=XACRO)
    at = whole.index("<link") if first else whole.rindex("</robot>")
    (folder / "left.urdf").write_text(whole[:at] + left + whole[at:])
    (folder / "plain.urdf").write_text(text())
    (note,) = read_urdf(folder / "left.urdf").notes
    assert name in note
    assert content(folder / "left.urdf") == content(folder / "plain.urdf")


@settings(max_examples=12)
@given(words, st.sampled_from(["z", "r", "tip"]), st.booleans(), st.data())
def test_an_expression_of_xacro_is_named_with_what_expands_it(
    tmp_path_factory, name, where, declared, data
):
    path = tmp_path_factory.mktemp("xacro") / "used.urdf"
    found = data.draw(st.sampled_from(["${%s}", "${2*%s}", "$(arg %s)"])) % name
    left = f'<xacro:property name="{name}" value=".05"/>' if declared else ""
    path.write_text(text(xacro=f"{XACRO}>{left}<a/", **{where: found}))
    key = {"z": "xyz", "r": "radius", "tip": "name"}[where]
    with refused(f'used.urdf {key} "{found}" xacro .xacro'):
        read_urdf(path)


def test_what_xacro_would_replace_is_refused_and_simulators_addresses_are_not(tmp_path, run):
    path = tmp_path / "arm.urdf"
    for call in ("<xacro:include filename='a.xacro'/>", "<xacro:arm prefix='l_'/>"):
        path.write_text(text(xacro=f"{XACRO}>{call}<a/"))
        with refused(f"arm.urdf {call[1:].split()[0]} xacro"):
            read_urdf(path)
    plugin = "<gazebo><plugin><parameters>$(find arm)/a.yaml</parameters></plugin></gazebo>"
    path.write_text(text(xacro=f"{XACRO}>{plugin}<a/"))
    assert read_urdf(path).notes == ()
    left = '<xacro:property name="a" value="1"/>'
    path.write_text(text(xacro=f"{XACRO}>{left}{plugin}<a/"))
    assert len(read_urdf(path).notes) == 1
    colour = '<material name="m"><color rgba="${a} 0 0 1"/></material>'
    path.write_text(text(xacro=f"{XACRO}>{left}{colour}<a/"))
    with refused('arm.urdf "m" rgba "${a}" xacro'):
        read_urdf(path)
    # https://github.com/robot-descriptions/robot_descriptions.py/issues/59
    for inside in ("", '<xacro:macro name="arm"><link name="a"/></xacro:macro>'):
        path.write_text(f"<robot name='macro_only' {XACRO}>{inside}</robot>")
        code, _, err = run("robot", path, "--out", tmp_path / "out")
        assert code == 2
        assert has_parts(err, "arm.urdf link 0 xacro macro")


conflicts = st.sampled_from(
    [
        ("<<<<<<< HEAD\n{0}\n=======\n{1}\n>>>>>>> 1a2b3c4 (pose)\n"),
        ("<<<<<<< ours\r\n{0}\n||||||| base\n{0}\n=======\n{1}\n>>>>>>> theirs\r\n"),
        ("  <<<<<<< HEAD\n{0}\n  =======\n{1}\n  >>>>>>> branch\n"),
        (">>>>>>> 1a2b3c4\n{0}\n"),
        ("=======\n{0}\n"),
    ]
)


@settings(max_examples=20)
@given(st.integers(0, len(LINES) - 1), conflicts)
def test_a_merge_conflict_is_named_with_its_line(tmp_path_factory, at, form):
    path = tmp_path_factory.mktemp("conflict") / "arm.urdf"
    lines = text().split("\n")
    path.write_bytes(
        "\n".join([*lines[:at], form.format(lines[at], lines[at]), *lines[at + 1 :]]).encode()
    )
    with refused(f"arm.urdf line {at + 1}"):
        read_urdf(path)
    remark = f"<!--\n{form.format('', '')}-->"  # nothing of it counts
    path.write_text(text().replace("</robot>", f"{remark}</robot>"))
    assert read_urdf(path).notes == ()


STAND_INS = {
    "Git LFS": b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 684\n",
    "HTML": b"\n<!DOCTYPE html>\n<html lang='en'><head></head></html>",
    "HTML page": b"\xef\xbb\xbf<!-- saved --><html><body>404</body></html>",
    "conflict 3": b"v 0 0 0\nv 1 0 0\n<<<<<<< HEAD\nv 0 1 0\n=======\nv 0 2 0\n>>>>>>> a\n",
}


@pytest.mark.parametrize(("parts", "data"), STAND_INS.items())
def test_what_stands_in_place_of_a_file_is_named(tmp_path, run, parts, data):
    """Git LFS: https://github.com/ros-industrial/motoman/issues/60 and many others."""
    path = tmp_path / "arm.urdf"
    path.write_bytes(data)
    code, _, err = run("robot", path, "--out", tmp_path / "out")
    assert code == 2
    assert has_parts(err, f"arm.urdf {parts}")
    for suffix in ("stl", "obj", "dae", "gltf", "glb"):
        (tmp_path / f"upper.{suffix}").write_bytes(data)
        mesh = f'<mesh filename="upper.{suffix}"/>'
        path.write_text(text().replace('<cylinder radius="0.05" length="0.4"/>', mesh))
        with refused(f'arm.urdf "upper" "upper.{suffix}" {parts}'):
            UrdfOptions().fit(path)
    (tmp_path / "scene.toml").write_text('[[obstacles]]\nfile = "cell.obj"\n')
    (tmp_path / "cell.obj").write_bytes(data)
    code, _, err = run("verify", "n1_8_0", "--scene", "scene.toml")
    assert code == 2
    assert has_parts(err, f'scene.toml obstacles[0].file "cell.obj" {parts}')
    for name, words in {
        "scene.toml": ["n1_8_0", "--scene"],
        "kinematics.yaml": ["n1_8_0", "--calibration"],
        "calibration.conf": ["n1_8_0", "--calibration"],
        "proposal.toml": [],
        "poses.csv": [],
        "poses.json": [],
    }.items():
        (tmp_path / name).write_bytes(data)
        code, _, err = run("verify", *words, name)
        assert code == 2
        assert has_parts(err, f"{name} {parts}")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("end", [b"", b"-->"])
def test_a_search_for_comments_takes_time_in_proportion_to_a_file(end):
    """Comments that do not end, 4 MB of them, took more than 40 s."""
    data = b"<!--" * 1_000_000 + end + b"\n>>>>>>> a\n" + b"<!--" * 1_000_000
    begin = time.process_time()
    with refused("a.urdf conflict 2"):
        refuse_stand_in(data, "a.urdf")
    assert time.process_time() - begin < 2


starts = st.sampled_from(
    ["file:///home/me/ws", "file://localhost/opt/ros", "file:/opt/ros", "/home/me", "file:///C:/ros",
     "file:///c%3A/ros", r"file:///C:\ros", r"C:\ros", "D:/ros", "file:////srv/ros",
     "FILE:///home/me"]
)  # fmt: skip


# https://github.com/Kinovarobotics/ros2_kortex: addresses of the machine on which xacro ran
@settings(max_examples=20)
@given(starts, st.sampled_from(["share", "src", "install/arm/share"]), st.booleans(), st.data())
def test_absolute_addresses_of_another_machine_are_found_by_their_package(
    tmp_path_factory, start, above, doubled, data
):
    """By what follows share/NAME, or NAME of a package that the user gives; the note names it."""
    folder = tmp_path_factory.mktemp("elsewhere")
    file = folder / "given" / "arm" / "meshes" / "upper.stl"
    file.parent.mkdir(parents=True)
    trimesh.creation.box().export(file)
    (folder / "urdf").mkdir()
    slash = "\\" if "\\" in start else "/"
    parts = [start, *above.split("/"), "arm", "meshes" + slash * doubled, "upper.stl"]
    name, urdf = slash.join(parts), folder / "urdf" / "arm.urdf"
    with refused('"upper" --package arm=FOLDER --skip-missing-meshes'):
        Packages(urdf).find(name, "upper")
    options = data.draw(
        st.sampled_from(
            [
                {"folders": [folder / "given"]},
                {"folders": [folder / "given" / "arm"]},
                {"named": {"arm": folder / "given" / "arm"}},
            ]
        )
    )
    packages = Packages(urdf, **options)
    assert packages.find(name, "upper") == file.resolve()
    (note,) = packages.notes
    assert str(folder / "given") in note
    with refused("none.stl"):
        packages.find(name.replace("upper", "none"), "upper")
    climbing = name.replace(f"arm{slash}", f"arm{slash}..{slash}..{slash}", 1)
    with refused("upper"):
        packages.find(climbing, "upper")


@given(
    st.sampled_from(
        ["file://robotpc/opt/ros/share/arm", "File://10.0.0.7/ws/src/share/arm", "package:///arm",
         "PACKAGE://arm", "package:////arm", "model:///arm", "install/arm/share/arm"]
    ),
    st.booleans(),
)  # fmt: skip
def test_addresses_with_a_host_or_too_many_slashes_lead_to_their_package(
    tmp_path_factory, start, quoted
):
    folder = tmp_path_factory.mktemp("hosts")
    file = folder / "given" / "arm" / "meshes" / "upper arm.stl"
    file.parent.mkdir(parents=True)
    trimesh.creation.box().export(file)
    quoted &= "://" in start
    name = f"{start}/meshes/upper{'%20' if quoted else ' '}arm.stl"
    urdf = folder / "arm.urdf"
    with refused('"upper" --package arm=FOLDER'):
        Packages(urdf, addresses=[name]).find(name, "upper")
    for options in ({"folders": [folder / "given"]}, {"named": {"arm": folder / "given" / "arm"}}):
        packages = Packages(urdf, addresses=[name], **options)
        assert packages.find(name, "upper") == file.resolve()
        assert len(packages.notes) == (not start.lower().startswith(("package", "model")))


def test_an_own_package_serves_absolute_addresses_and_others_stay_outside(tmp_path):
    own = tmp_path / "checkout"
    (own / "urdf").mkdir(parents=True)
    (own / "meshes").mkdir()
    (own / "package.xml").write_text("<package><name>arm_description</name></package>")
    trimesh.creation.box().export(own / "meshes" / "a.stl")
    trimesh.creation.box().export(tmp_path / "b.stl")
    packages = Packages(own / "urdf" / "arm.urdf")
    for start in ("file:///home/x/src", "file:///opt/ros/jazzy/share"):
        found = packages.find(f"{start}/arm_description/meshes/a.stl", "l")
        assert found == (own / "meshes" / "a.stl").resolve()
    with refused("outside"):
        packages.find(f"file://{tmp_path}/b.stl", "l")
    assert Packages(tmp_path / "arm.urdf").find(f"file://{tmp_path}/b.stl", "l").name == "b.stl"


def test_meshes_of_another_machine_can_be_left_out(tmp_path):
    mesh = '<mesh filename="file:///home/me/arm/meshes/upper.stl"/></geometry></collision>'
    cylinder = '<cylinder radius="0.05" length="0.4"/></geometry></collision>'
    more = f"{cylinder}<collision><geometry>{mesh}"
    (tmp_path / "arm.urdf").write_text(text().replace(cylinder, more))
    (tmp_path / "plain.urdf").write_text(text())
    with refused("--skip-missing-meshes"):
        UrdfOptions().fit(tmp_path / "arm.urdf")
    fit = UrdfOptions(skip_missing_meshes=True).fit(tmp_path / "arm.urdf")
    assert [repr(body) for body in fit.robot.bodies] == bodies(tmp_path / "plain.urdf")
    assert any("upper.stl" in note for note in fit.notes)


# TechmanRobotInc/tmr_ros2: visual meshes that are not there
def test_mounts_of_links_whose_visual_meshes_are_left_out_follow_the_collision_shapes(tmp_path):
    cylinder = '<cylinder radius="0.05" length="0.4"/></geometry></collision>'
    gone = '<visual><geometry><mesh filename="gone.obj"/></geometry></visual>'
    (tmp_path / "arm.urdf").write_text(text().replace(cylinder, cylinder + gone))
    (tmp_path / "plain.urdf").write_text(text())
    options = UrdfOptions(skip_missing_meshes=True)
    fits = [options.fit(tmp_path / name) for name in ("arm.urdf", "plain.urdf")]
    assert [repr(m) for m in fits[0].robot.mounts] == [repr(m) for m in fits[1].robot.mounts]
    bare = text().replace("cylinder radius=", "mesh filename='gone.stl' radius=")
    (tmp_path / "bare.urdf").write_text(bare)
    assert options.fit(tmp_path / "bare.urdf").robot.bodies == ()


# https://github.com/elephantrobotics/mycobot_ros/issues/54
@settings(max_examples=4)
@given(st.floats(0.3, 0.6), st.floats(0.02, 0.06), st.booleans())
def test_a_visual_surface_outside_the_body_is_noted_with_its_depth(
    tmp_path_factory, length, radius, beside
):
    """A cylinder across (or along) a rod: how far its end is outside is known."""
    path = tmp_path_factory.mktemp("beside") / "arm.urdf"
    turned = 'rpy="0 1.5707963267948966 0"' if beside else ""
    shape = f'<geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
    rod = f'<visual><geometry><cylinder radius="0.004" length="{length}"/></geometry></visual>'
    path.write_text(
        "<robot name='r'><link name='a'/><link name='b'><collision>"
        f"<origin xyz='0 0 0' {turned}/>{shape}</collision>{rod}</link>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
        "<origin xyz='0 0 0.1'/></joint></robot>"
    )
    notes = UrdfOptions().fit(path, capsules=1).notes
    if not beside:
        assert notes == ()
        return
    (note,) = notes
    depth = float(note.partition('"b" by ')[2].partition(" mm")[0])
    assert depth == pytest.approx(1000 * (length / 2 - radius), abs=4)
    assert "--surface visual" in note
    assert UrdfOptions().fit(path, capsules=1, surface="visual").notes == ()


@settings(max_examples=6)
@given(st.lists(st.sampled_from([-1.0, 1.0]), min_size=3, max_size=3), st.floats(0.5, 2))
def test_a_mirrored_mesh_faces_outward(tmp_path_factory, signs, factor):
    """https://github.com/enactic/openarm_description/pull/57: a half mesh with a negative scale."""
    folder = tmp_path_factory.mktemp("mirror")
    wedge = trimesh.convex.convex_hull([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]])
    wedge.export(folder / "half.stl")
    scale = factor * np.array(signs)
    shape = f'<mesh filename="half.stl" scale="{scale[0]} {scale[1]} {scale[2]}"/>'
    path = folder / "arm.urdf"
    moved = text().replace("<axis", '<origin xyz="0 0 0.2"/><axis')
    path.write_text(moved.replace('<cylinder radius="0.05" length="0.4"/>', shape))
    urdf = read_urdf(path)
    made = Meshes(path).shape(urdf.links["upper"].collision[0], "upper")
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(made))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(factor**3 * 0.1 * 0.2 * 0.3 / 6, rel=1e-5)
    outward = np.einsum("ti,ti->t", mesh.face_normals, mesh.triangles_center - mesh.center_mass)
    assert (outward > 0).all()
    robot = UrdfOptions().fit(path, capsules=1).robot
    scene = Scene(robot=robot, poses=(Pose(robot.rest),))
    data = FORMATS["glb"](PlacedSetup(scene, Setup(()), 0, folder, urdf))["scene.glb"]
    exported = trimesh.load(io.BytesIO(data), file_type="glb").geometry["body_upper"]
    assert exported.volume == pytest.approx(mesh.volume, rel=1e-4)


@pytest.mark.slow
def test_the_ring_radius_of_a_scene_is_that_of_mounts_that_take_a_ring(tmp_path):
    """A wide shaft within the base's housing takes no ring, so its radius does not count; the scene
    stays valid. TechmanRobotInc/tmr_ros2: 18 % instead of 40.6."""

    def link(name, radius, length):
        at = f'<origin xyz="0 0 {length / 2}"/>'
        shape = f'<geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
        return f'<link name="{name}"><collision>{at}{shape}</collision></link>'

    def joint(name, kind, parent, child, z):
        ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 {z}"/>'
        return f'<joint name="{name}" type="{kind}">{ends}<axis xyz="0 0 1"/></joint>'

    def robot(housing):
        (tmp_path / "arm.urdf").write_text(
            f'<robot name="arm">{link("base", housing, 0.5)}{link("shaft", 0.15, 0.5)}'
            f'{link("fore", 0.04, 0.5)}<link name="tip"/>'
            f"{joint('turn', 'continuous', 'base', 'shaft', 0)}"
            f"{joint('bend', 'continuous', 'shaft', 'fore', 0.5)}"
            f"{joint('end', 'fixed', 'fore', 'tip', 0.5)}</robot>"
        )
        return UrdfOptions().fit(tmp_path / "arm.urdf", capsules=1).robot

    assert ring_radii(robot(0.05))[0] > 0.15
    radius, none = ring_radii(robot(0.4))
    assert radius < 0.1
    assert set(none) == {"shaft"}
    (tmp_path / "robot.toml").write_text(to_toml(robot(0.4), file=RobotFile))
    (tmp_path / "scene.toml").write_text(scene_text(robot(0.4), "robot.toml"))
    housed = read_scene(tmp_path / "scene.toml")
    assert housed.ring_radius == radius
    assert housed.mounts["shaft"].radius > 0.15
    links = {segment.link for segment in FeasibleSet(housed, sensors=6, rings=1).segments}
    assert "shaft" not in links
    assert "fore" in links
