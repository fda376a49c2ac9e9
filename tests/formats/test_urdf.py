"""URDFs: what is drawn is read as MuJoCo reads it, and what is bad is one clear line, with nothing
written.
"""

import math
import os
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from place_rings.cli import app as command_line
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.targets import Shape, Target, robot_curve, target_solid
from place_rings.formats.errors import UserError
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.robot_fit import FittedLink, outlines
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain

from ..support import drawing
from ..support.urdf_text import Peer, chain_text, drawn_chain, joint

A, B = "<link name='a'/>", "<link name='b'/>"


def moved(
    name="j",
    kind="revolute",
    parent="a",
    child="b",
    inside="<limit lower='-1' upper='1'/>",
    xyz="0 0 1",
):
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}'/><axis xyz='0 0 1'/>{inside}</joint>"
    )


def mesh(name, scale="1 1 1"):
    return (
        f"<link name='b'><collision><geometry><mesh filename='{name}'"
        f" scale='{scale}'/></geometry></collision></link>"
    )


def quoted(text):
    """Text with double quotes in place of its underscores."""
    return text.replace("_", chr(34))


def shape(text):
    return f"<link name='b'><collision><geometry>{text}</geometry></collision></link>"


LAUGHS = "<!DOCTYPE r [<!ENTITY a 'ha'>" + "".join(
    f"<!ENTITY {b} '{f'&{a};' * 10}'>" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
MIMIC = quoted("<limit lower=_-1_ upper=_1_/><mimic joint=_j_/>")
BAD = {
    "<robot": "not XML",
    "": "not XML",
    "<sdf/>": 'root: found "sdf", allowed: robot',
    "<robot/>": "link: found 0, allowed: 1 to",
    LAUGHS + "]><robot name='&i;'/>": "found a document type, allowed: XML without one",
    "<!DOCTYPE r SYSTEM 'file:///etc/passwd'><robot/>": "found a document type",
    f"<robot>{A}{B}</robot>": 'found 0 moving joints from link "a"',
    f"<robot>{A}{A}</robot>": 'link: found "a", allowed: unique names',
    f"<robot>{A}{B}{moved(kind='screw')}</robot>": (
        'joint "j": type: found "screw", allowed: revolute, continuous'
    ),
    f"<robot>{A}{B}{moved(kind='planar')}</robot>": (
        'joint: found 0 moving joints from link "a", allowed: 1 to 20'
    ),
    f"<robot>{A}{B}{moved(kind='floating')}</robot>": ('found 0 moving joints from link "a"'),
    f"<robot>{A}{B}{moved(inside=quoted('<limit lower=_-1_ upper=_nan_/>'))}</robot>": (
        "limit upper"
    ),
    f"<robot>{A}{B}{moved(child='c')}</robot>": (
        'joint "j": child: found "c", allowed: a link of the file'
    ),
    f"<robot>{A}{B}{moved(xyz='0 0 x')}</robot>": "origin xyz",
    f"<robot>{A}{B}{moved(xyz='0 0 inf')}</robot>": "origin xyz",
    f"<robot>{A}{B}{moved(xyz='0 0 0')}</robot>": "found a chain without length from a to b",
    f"<robot>{A}{B}{moved()}{moved('k')}</robot>": "allowed: one parent joint for each link",
    f"<robot>{A}{B}{moved()}{moved('k', parent='b', child='a')}</robot>": "found a loop of joints",
    f"<robot>{A}{B}{moved(parent='b')}</robot>": "found a loop of joints",
    f"<robot>{A}{B}{moved()}{moved()}</robot>": 'joint: found "j", allowed: unique names',
    f"<robot>{A}{B}{moved(inside=MIMIC)}</robot>": (
        'joint "j": mimic: found "j", allowed: another joint of the chain'
    ),
    f"<robot>{A}{B}{moved(kind='fixed', inside='')}</robot>": "found 0 moving joints",
    f"<robot>{A}{B}<link name='c'/>{moved()}{moved('k', child='c')}</robot>": (
        "several chains are equally long; choose one: --tip b, or --tip c"
    ),
    f"<robot>{A}{mesh('nothing.stl')}{moved()}</robot>": (
        'link "b": mesh: found "nothing.stl", allowed: a file in'
    ),
    f"<robot>{A}{mesh('../out.stl')}{moved()}</robot>": "this one is outside",
    f"<robot>{A}{mesh('/etc/hostname')}{moved()}</robot>": "this one is outside",
    f"<robot>{A}{mesh('link.stl')}{moved()}</robot>": "this one is outside",
    f"<robot>{A}{mesh('folder/out.stl')}{moved()}</robot>": "this one is outside",
    f"<robot>{A}{mesh('package://../out.stl')}{moved()}</robot>": "this one is outside",
    f"<robot>{A}{mesh('package://x/%2e%2e/%2e%2e/out.stl')}{moved()}</robot>": (
        "this one is outside"
    ),
    f"<robot>{A}{mesh('http://192.0.2.1/a.stl')}{moved()}</robot>": (
        "allowed: package://, file:// or a path"
    ),
    f"<robot>{A}{mesh('bad.stl')}{moved()}</robot>": 'mesh: found "bad.stl", allowed:',
    f"<robot>{A}{mesh('laughs.dae')}{moved()}</robot>": "found a document type",
    f"<robot>{A}{mesh('mesh.ply')}{moved()}</robot>": "a mesh of the format stl, dae, obj",
    f"<robot>{A}{mesh('good.stl', '0 1 1')}{moved()}</robot>": "mesh scale",
    f"<robot>{A}{mesh('huge.stl')}{moved()}</robot>": (
        'mesh "huge.stl": found more than 128 MB, allowed: at most 128 MB'
    ),
    f"<robot>{A}{mesh('nan.obj')}{moved()}</robot>": "triangles of finite numbers",
    f"<robot>{A}{mesh('far.obj')}{moved()}</robot>": "m from the link's frame",
    f"<robot>{A}{mesh('good.stl', '1000 1000 1000')}{moved()}</robot>": (
        "150 m from the link's frame"
    ),
    f"<robot>{A}{mesh('round.stl')}{moved()}</robot>": (
        'mesh: found "round.stl", allowed: a file in'
    ),
    f"<robot>{A}{shape(quoted('<cylinder radius=_0.1_ length=_-1_/>'))}{moved()}</robot>": (
        "sizes of at least 0"
    ),
    f"<robot>{A}{shape(quoted('<box size=_1 1_/>'))}{moved()}</robot>": "box size",
    f"<robot>{A}{shape('<torus/>')}{moved()}</robot>": (
        'geometry: found "torus", allowed: one of box'
    ),
}


@pytest.fixture
def folder(tmp_path):
    """A folder with good and bad meshes, and one outside."""
    inside = tmp_path / "in"
    inside.mkdir()
    trimesh.creation.box((0.1, 0.1, 0.3)).export(inside / "good.stl")
    trimesh.creation.box().export(tmp_path / "out.stl")
    (inside / "link.stl").symlink_to(tmp_path / "out.stl")
    (inside / "folder").symlink_to(tmp_path)
    (inside / "bad.stl").write_bytes(b"solid nothing\nfacet")
    with (inside / "huge.stl").open("wb") as file:
        file.truncate(129 * 2**20)  # takes no room on the disk
    (inside / "nan.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (inside / "far.obj").write_text("v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (inside / "round.stl").symlink_to("round.stl")
    (inside / "mesh.ply").write_bytes(b"ply")
    (inside / "laughs.dae").write_text(LAUGHS + "]><COLLADA>&i;</COLLADA>")
    return inside


@pytest.mark.parametrize("text", BAD)
def test_a_bad_robot_is_one_line_and_nothing_is_written(folder, text, monkeypatch, capsys):
    path, out = folder / "bad.urdf", folder / "out"
    path.write_text(text)
    for command in (
        ["robot", str(path), "--out", str(out)],
        ["verify", "n1_8_0", "--robot", str(path)],
    ):
        monkeypatch.setattr(sys, "argv", ["place-rings", *command])
        with pytest.raises(SystemExit) as left:
            command_line.main()
        told = capsys.readouterr().err.strip()
        assert left.value.code == 2
        assert "bad.urdf" in told
        assert BAD[text] in told
        assert "\n" not in told
        assert not out.exists()


@pytest.mark.parametrize(
    "text", [b"\xff\xfe\x00", "<robot name='\xe9'/>".encode("latin-1"), b"\0" * 100, b""]
)
def test_what_is_no_text_is_no_robot(folder, text):
    path = folder / "bytes.urdf"
    path.write_bytes(text)
    with pytest.raises(UserError, match=r"bytes.urdf: not XML: [^\n]*$"):
        read_urdf(path)


def test_links_that_are_flat_have_no_volume_to_compare():
    capsule = Capsules(np.zeros(3), np.ones(3), 0.1)
    flat, solid = (
        FittedLink("link", 0, np.zeros((1, 3, 3)), (capsule,), 0.2, v) for v in (0.0, 0.1)
    )
    assert outlines([flat]) == "1 capsules around 1 links, which are flat"
    assert outlines([flat, solid]) == "2 capsules around 2 links, 4.00 times their volume"


def test_entities_are_never_expanded(folder):
    """A parser that expanded them would take gigabytes; this one is out at the document type, in a
    small process.
    """
    (folder / "laughs.urdf").write_text(LAUGHS + "]><robot name='&i;'/>")
    code = (
        "import resource, sys\nfrom pathlib import Path\nfrom place_rings.formats.robots.urdf"
        " import read_urdf\nbefore = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\ntry:\n   "
        " read_urdf(Path(sys.argv[1]))\nexcept Exception as error:\n   "
        " print(type(error).__name__)\nprint(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss -"
        " before < 20_000)"
    )
    env = {**os.environ, "PYTHONSAFEPATH": "1"}
    found = subprocess.run(
        [sys.executable, "-c", code, str(folder / "laughs.urdf")],
        capture_output=True,
        text=True,
        check=True,
        env=env,
    )
    assert found.stdout.split() == ["UserError", "True"]


def test_meshes_are_found_where_the_user_allows(folder, tmp_path):
    other = tmp_path / "packages" / "arm"
    (other / "meshes").mkdir(parents=True)
    trimesh.creation.box().export(other / "meshes" / "a.stl")
    path = folder / "robot.urdf"
    path.write_text("<robot/>")
    assert Meshes(path).find("good.stl", "b") == (folder / "good.stl").resolve()
    assert Meshes(path).find("package://in/good.stl", "b") == (folder / "good.stl").resolve()
    assert Meshes(path).find(f"file://{folder}/good.stl", "b") == (folder / "good.stl").resolve()
    for given_folder in (other.parent, other, other / "meshes"):
        found = Meshes(path, [given_folder]).find("package://arm/meshes/a.stl", "b")
        assert found == (other / "meshes" / "a.stl").resolve()
    with pytest.raises(UserError, match="allowed: a file in"):
        Meshes(path).find("package://arm/meshes/a.stl", "b")
    with pytest.raises(UserError, match="--packages"):
        Meshes(path, [tmp_path / "nowhere"])


@settings(max_examples=25)
@given(drawing.seeds)
def test_drawn_urdfs_move_as_mujoco_says(tmp_path_factory, seed):
    """Any axes, coinciding joints, fixed joints between."""
    rng = np.random.default_rng(seed)
    chain = drawn_chain(rng)
    root = ET.fromstring(chain_text(chain))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-1, 1, 3)
    T[:3, 0] *= np.linalg.det(T[:3, :3])
    ET.SubElement(root, "link", name="tool")
    joint(root, "to_tool", "fixed", "tip", "tool", T)
    text = ET.tostring(root, encoding="unicode")
    path = tmp_path_factory.mktemp("urdf") / "drawn.urdf"
    path.write_text(text)
    picked, peer = pick_chain(read_urdf(path), "base", "tool"), Peer(text)
    assert (picked.base, picked.tip) == ("base", "tool")
    assert picked.chain.joints == chain.joints
    free, stroke = (-np.inf, np.inf), (-10, 10)
    assert np.array_equal(picked.limits, [stroke if s else free for s in chain.slides])
    for _ in range(3):
        q = drawing.pose(rng, len(chain))
        found = forward(picked.chain, q)[-1]
        wanted = peer.pose(dict(zip(chain.joints, q, strict=True)), "tool", "base")
        assert np.abs(found - wanted).max() < 1e-9


def test_a_chain_can_begin_and_end_anywhere(tmp_path):
    robot, path = ROBOTS["iiwa14"], tmp_path / "iiwa.urdf"
    path.write_text(chain_text(robot.chain))
    part = pick_chain(read_urdf(path), "link_1", "link_4")
    assert part.chain.joints == robot.chain.joints[2:5]
    q = np.array([0.3, -0.2, 0.9])
    whole = forward(robot.chain, np.array([0, 0, *q, 0, 0]))
    assert np.allclose(forward(part.chain, q)[-1], np.linalg.inv(whole[1]) @ whole[4], atol=1e-12)
    for base, tip, line in (
        (None, "nothing", "--tip"),
        ("link_4", "link_1", "--tip"),
        ("tip", None, "--base"),
    ):
        with pytest.raises(UserError, match=line):
            pick_chain(read_urdf(path), base, tip)


def test_what_a_joint_beside_the_chain_moves_stands_still_and_is_named(tmp_path):
    text = "<robot><link name='a'/><link name='b'/><link name='c'/><link name='d'/><link name='e'/>"
    text += moved() + moved("k", parent="b", child="c") + moved("side", "prismatic", "b", "d")
    text += moved("stuck", "fixed", "b", "e", "") + "</robot>"
    path = tmp_path / "hand.urdf"
    path.write_text(text)
    picked = pick_chain(read_urdf(path), tip="c")
    assert [(h.joint, h.value, h.slides) for h in picked.held] == [("side", 0, True)]
    assert any("side=0" in note for note in picked.notes)
    assert {c.link.name for c in picked.carried} == {"a", "b", "c", "d", "e"}
    assert [c.link.name for c in picked.carried if c.beside] == ["d"]


@settings(max_examples=15)
@given(drawing.seeds)
def test_targets_of_drawn_chains(seed):
    """Coinciding joints make no empty segment: the shell is there, and the curve ends at the
    tip.
    """
    rng = np.random.default_rng(seed)
    chain = drawn_chain(rng)
    robot = ROBOTS["panda"].__class__("drawn", chain, (), 1.0)
    q = drawing.pose(rng, len(chain))
    curve = robot_curve(robot, q, Shape())
    assert np.allclose(curve.pieces[-1].control[-1], forward(chain, q)[-1, :3, 3])
    assert math.isfinite(curve.arc_length())
    assert np.isfinite(
        target_solid(Target("V_S", 0.4), robot, q)(rng.uniform(-1, 1, (50, 3)))
    ).all()


@pytest.mark.long
def test_a_missing_mesh_is_left_out_only_where_the_user_says_so(run, tmp_path):
    """One note a file; the rest of the body is fitted as before."""
    from place_rings.formats.robots.urdf_options import UrdfOptions

    path, ball = tmp_path / "r.urdf", "<geometry><sphere radius='0.05'/></geometry>"
    gone = "<collision><geometry><mesh filename='gone.stl'/></geometry></collision>"
    lost = "<collision><geometry><mesh filename='../lost.stl'/></geometry></collision>"
    robot = (
        f"<robot name='r'><link name='a'><collision>{ball}</collision></link>"
        "<link name='b'><collision>{0}</collision>{1}</link>{2}</robot>"
    )
    path.write_text(robot.format(ball, gone, moved()))
    with pytest.raises(UserError, match=r"gone\.stl.*--skip-missing-meshes leaves it out"):
        UrdfOptions().fit(path)
    fit = UrdfOptions(skip_missing_meshes=True).fit(path)
    (note,) = fit.notes
    assert "gone.stl" in note
    assert 'link "b" is incomplete' in note
    path.write_text(robot.format(ball, "", moved()))
    whole = UrdfOptions().fit(path)
    assert [repr(b) for b in fit.robot.bodies] == [repr(b) for b in whole.robot.bodies]
    path.write_text(robot.format(ball, lost, moved()))  # outside of all permitted folders
    (tmp_path.parent / "lost.stl").write_text("solid")
    with pytest.raises(UserError, match="this one is outside"):
        UrdfOptions(skip_missing_meshes=True).fit(path)
    code, out, err = run("verify", "n1_8_0", "--skip-missing-meshes")
    assert (code, out) == (2, "")
    assert "--skip-missing-meshes: allowed only with" in err
