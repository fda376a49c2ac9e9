"""Readers of mesh files: what trimesh writes comes back, nodes stand where they should, and damaged
or hostile files are refused before any work. Nothing vanishes silently."""

import json
import struct
import time
import tracemalloc

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.solids.polyhedra import MOST_FACES, hull
from place_rings.formats.mesh_readers.collada import read_collada
from place_rings.formats.mesh_readers.gltf import read_gltf
from place_rings.formats.mesh_readers.mesh_numbers import (
    MOST_CORNERS,
    MOST_PARTS,
    MOST_TRIANGLES,
    MeshError,
    placed,
    strips,
)
from place_rings.formats.mesh_readers.obj import read_obj
from place_rings.formats.mesh_readers.scene_mesh import read_scene_parts
from place_rings.formats.mesh_readers.stl import read_stl
from place_rings.formats.robots.xml_text import plain_xml
from scipy.spatial.transform import Rotation

from ..support import drawing
from ..support.refusals import has_parts, refused

Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # of glTF
KINDS = ("stl", "stl_ascii", "obj", "dae", "gltf", "glb")


def collada(data):
    return read_collada(plain_xml(data, "a.dae"))


def nothing(uri):
    raise MeshError(f"no file {uri}")


def read(kind, data, beside=nothing):
    """Triangles of a file of this kind."""
    if kind in ("gltf", "glb"):
        return read_gltf(data, beside)
    return {"stl": read_stl, "stl_ascii": read_stl, "obj": read_obj, "dae": collada}[kind](data)


def solid(rng):
    """A convex solid with outward faces."""
    return trimesh.convex.convex_hull(rng.uniform(-0.3, 0.3, (12, 3)))


def written(kind, mesh):
    """A file of a mesh or a scene, as trimesh writes it, with the files beside it."""
    if kind == "gltf":
        files = trimesh.Scene(mesh).export(file_type="gltf")
        return files.pop("model.gltf"), files.__getitem__
    made = mesh.export(file_type=kind)
    return made.encode() if isinstance(made, str) else made, nothing


def in_order(triangles):
    """Triangles with the smallest corner first, in a fixed order."""
    t = np.round(triangles, 5) + 0.0
    first = [min(range(3), key=lambda i: tuple(row[i])) for row in t]
    turned = [np.roll(row, -i, axis=0).ravel() for row, i in zip(t, first, strict=True)]
    return np.array(sorted(turned, key=tuple))


def volume(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return float((a * np.cross(b, c)).sum()) / 6


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=6)
@given(seed=drawing.seeds)
def test_what_trimesh_writes_comes_back(kind, seed):
    mesh = solid(np.random.default_rng(seed))
    triangles = read(kind, *written(kind, mesh))
    wanted = np.array(mesh.triangles)
    if kind in ("gltf", "glb"):
        wanted = placed(wanted, Z_UP)
    assert np.allclose(in_order(triangles), in_order(wanted), atol=2e-5)
    assert volume(triangles) == pytest.approx(mesh.volume, rel=1e-3)


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"
version="1.4.1"><asset><up_axis>{up}</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">{points}</float_array><technique_common>
<accessor source="#a" count="4" stride="3"/></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#p"/></vertices>{faces}</mesh></geometry></library_geometries>
{nodes}<library_visual_scenes><visual_scene id="s">{scene}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
POINTS = "0 0 0 1 0 0 0 1 0 0 0 1"
FACES = """<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>"""
GEOMETRY = '<instance_geometry url="#g"/>'


def dae(points=POINTS, faces=FACES, nodes="", scene=f"<node>{GEOMETRY}</node>", up="Z_UP"):
    return DAE.format(up=up, points=points, faces=faces, nodes=nodes, scene=scene).encode()


def words(values):
    return " ".join(f"{v:.9g}" for v in np.ravel(values))


def pose(rng):
    """A drawn transform, half of them mirrored."""
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    T[:3, :3] *= rng.uniform(0.5, 2, 3) * np.array([rng.choice([-1, 1]), 1, 1])
    T[:3, 3] = rng.uniform(-1, 1, 3)
    return T


@settings(max_examples=15)
@given(drawing.seeds, st.integers(0, 4), st.sampled_from(["Y_UP", "Z_UP", "X_UP"]))
def test_nodes_of_collada_nest_and_up_axis_does_not_count(seed, deep, up):
    """https://github.com/mikedh/trimesh/issues/954; as RViz shows them. Mirrored nodes face
    outward, too."""
    rng = np.random.default_rng(seed)
    poses, scene, T = [pose(rng) for _ in range(deep)], GEOMETRY, np.eye(4)
    for M in reversed(poses):
        scene = f"<node><matrix>{words(M)}</matrix>{scene}</node>"
    for M in poses:
        T = T @ M
    found = collada(dae(scene=f"<node>{scene}</node>", up=up))
    corners = T[:3, 3] + np.vstack([np.zeros(3), T[:3, :3].T])
    assert np.allclose(
        np.unique(np.round(found.reshape(-1, 3), 5), axis=0),
        np.unique(np.round(corners, 5) + 0.0, axis=0),
        atol=2e-5,
    )
    assert volume(found) == pytest.approx(abs(np.linalg.det(T[:3, :3])) / 6, rel=1e-4)


@settings(max_examples=10)
@given(drawing.seeds)
def test_transforms_of_a_node_are_multiplied_in_their_order(seed):
    rng = np.random.default_rng(seed)
    shift, turn, size = rng.uniform(-1, 1, 3), rng.uniform(-180, 180), rng.uniform(0.5, 2, 3)
    node = f"<translate>{words(shift)}</translate><rotate>0 0 1 {turn}</rotate>"
    found = collada(dae(scene=f"<node>{node}<scale>{words(size)}</scale>{GEOMETRY}</node>"))
    R = Rotation.from_euler("z", turn, degrees=True).as_matrix()
    wanted = shift + np.vstack([np.zeros(3), (R * size).T])
    assert np.allclose(
        np.unique(np.round(found.reshape(-1, 3), 5), axis=0),
        np.unique(np.round(wanted, 5), axis=0),
        atol=2e-5,
    )


POLYGONS = {
    "polylist": "<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p>",
    "polygons": "".join(f"<p>{p}</p>" for p in ("0 2 1", "0 1 3", "0 3 2", "1 2 3")),
    "tristrips": "<p>0 2 1 3 0 2</p>",
    "trifans": "".join(f"<p>{p}</p>" for p in ("0 2 1", "0 1 3", "0 3 2", "1 2 3")),
}


@pytest.mark.parametrize(("tag", "inside"), POLYGONS.items())
def test_polygons_strips_and_fans_are_the_same_solid(tag, inside):
    vertex = '<input semantic="VERTEX" source="#v" offset="0"/>'
    found = collada(dae(faces=f"<{tag}>{vertex}{inside}</{tag}>"))
    assert abs(volume(found)) == pytest.approx(1 / 6)


@given(st.lists(st.integers(0, 7), min_size=1, max_size=6))
def test_every_second_triangle_of_a_strip_is_turned(corners):
    wanted, begin = [], 0
    for count in corners:
        at = range(begin, begin + max(count - 2, 0))
        wanted += [[i, i + 1 + (i - begin) % 2, i + 2 - (i - begin) % 2] for i in at]
        begin += count
    assert strips(np.array(corners)).tolist() == wanted


def gltf(points, index, **more):
    """A glTF file of one mesh with its buffer within."""
    data = np.asarray(points, "<f4").tobytes() + np.asarray(index, "<u2").tobytes()
    size = 4 * np.size(points)
    return data, {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data), "uri": "mesh.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": size},
            {"buffer": 0, "byteOffset": size, "byteLength": len(data) - size},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": len(index), "type": "SCALAR"},
        ],
        **more,
    }


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
INDEX = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


@settings(max_examples=15)
@given(drawing.seeds, st.integers(1, 4))
def test_nodes_of_gltf_nest_and_its_y_is_the_links_z(seed, deep):
    """https://github.com/RobotLocomotion/models: (x, y, z) becomes (x, -z, y)."""
    rng = np.random.default_rng(seed)
    poses, T = [pose(rng) for _ in range(deep)], Z_UP
    nodes = [{"matrix": M.T.ravel().tolist(), "children": [i + 1]} for i, M in enumerate(poses)]
    for M in poses:
        T = T @ M
    data, file = gltf(CORNERS, INDEX, nodes=[*nodes, {"mesh": 0}])
    found = read_gltf(json.dumps(file).encode(), lambda uri: data)
    corners = T[:3, 3] + np.vstack([np.zeros(3), T[:3, :3].T])
    assert np.allclose(
        np.unique(np.round(found.reshape(-1, 3), 4), axis=0),
        np.unique(np.round(corners, 4) + 0.0, axis=0),
        atol=2e-4,
    )
    assert volume(found) == pytest.approx(abs(np.linalg.det(T[:3, :3])) / 6, rel=1e-4)


def test_gltf_needs_no_compression_no_loops_and_only_files_beside_it(tmp_path):
    data, file = gltf(CORNERS, INDEX)
    points, index = file["accessors"]
    odd = {
        "KHR_draco_mesh_compression": {"extensionsRequired": ["KHR_draco_mesh_compression"]},
        "tree 0": {"nodes": [{"mesh": 0, "children": [0]}]},
        "cut short 96": {"accessors": [points, {**index, "count": 24}]},
        "sparse": {"accessors": [{**a, "sparse": {}} for a in file["accessors"]]},
        "4 points 9": {},
        "standard": {"meshes": []},
    }
    for parts, change in odd.items():
        content = data if parts[0] != "4" else data.replace(b"\x03\x00", b"\x09\x00")
        with refused(parts, error=MeshError):
            read_gltf(json.dumps({**file, **change}).encode(), lambda uri, data=content: data)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=20)
@given(seed=drawing.seeds, share=st.floats(0, 1), flip=st.booleans())
def test_a_damaged_file_is_refused_or_a_finite_mesh(kind, seed, share, flip):
    """Cut at a byte, or with some bytes overwritten. Of a cut OBJ the rest is a mesh, too."""
    rng = np.random.default_rng(seed)
    data, beside = written(kind, solid(rng))
    at = int(share * (len(data) - 1))
    broken = data[:at] + rng.bytes(3) + data[at + 3 :] if flip else data[:at]
    try:
        found = read(kind, broken, beside)
    except (MeshError, UserError):
        return
    assert np.isfinite(found).all()
    assert flip or kind == "obj" or len(found) == len(read(kind, data, beside))


def test_a_binary_stl_may_begin_with_solid_and_a_cut_one_says_what_it_wants():
    """https://github.com/ros-industrial/motoman/issues/60."""
    box = trimesh.creation.box().export(file_type="stl")
    named = b"solid made by a CAD program".ljust(80) + box[80:]
    assert np.array_equal(read_stl(named), read_stl(box))
    for whole in (box, named):
        with refused(f"cut short {len(whole)} {len(whole) - 130} export", error=MeshError):
            read_stl(whole[:-130])
    with refused(f"{len(box)} 12 {len(box) + 1}", error=MeshError):
        read_stl(box + b"\0")
    text = trimesh.creation.box().export(file_type="stl_ascii").encode()
    with refused("cut short endsolid", error=MeshError):
        read_stl(text[: len(text) // 2])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_a_coordinate_that_is_not_finite_is_refused(kind, value):
    """COLLADA's triangles with such corners vanished."""
    mesh = solid(np.random.default_rng(0))
    if kind == "dae":
        data, beside = dae(points=POINTS.replace("1", value, 1)), nothing
    else:
        mesh.vertices[3] = float(value)
        with np.errstate(all="ignore"):
            data, beside = written(kind, mesh)
    with refused("finite" if kind != "stl_ascii" else "", error=MeshError):
        read(kind, data, beside)


def nested(levels, each):
    """Nodes that name one another, ``each`` times a level."""
    nodes = f'<node id="n0">{GEOMETRY}</node>'
    for i in range(levels):
        inside = each * f'<instance_node url="#n{i}"/>'
        nodes += f'<node id="n{i + 1}">{inside}</node>'
    return dae(
        nodes=f"<library_nodes>{nodes}</library_nodes>",
        scene=f'<node><instance_node url="#n{levels}"/></node>',
    )


def header(count):
    return bytes(80) + struct.pack("<I", count)


HOSTILE = {
    f"{MOST_TRIANGLES} {4 * 2**40}": ("dae", lambda: nested(40, 2)),
    f"{MOST_TRIANGLES} {4 * 10**9}": ("dae", lambda: nested(9, 10)),
    "100 nodes": ("dae", lambda: nested(300, 1)),
    "at most 100 nodes": (
        "dae",
        lambda: dae(scene='<node id="a"><instance_node url="#a"/><instance_node url="#a"/></node>'),
    ),
    f"{MOST_CORNERS} 300000": (
        "obj",
        lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * 100_000 + b"\n",
    ),
    "cut short": ("stl", lambda: header(2**32 - 1) + bytes(500)),
    f"{MOST_TRIANGLES} {MOST_TRIANGLES + 1}": (
        "stl",
        lambda: header(MOST_TRIANGLES + 1) + bytes(50 * (MOST_TRIANGLES + 1)),
    ),
    "3 corners": ("obj", lambda: b"v 0 0 0\nv 1 0 0\nf 1 2\n"),
    "3 points 6": ("obj", lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n"),
    "2 3": ("obj", lambda: b"v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    "numbers": ("obj", lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n"),
    "count from 1": ("obj", lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
    "5 triangles 4": ("dae", lambda: dae(faces=FACES.replace('"4"', '"5"'))),
    "4 points 9": ("dae", lambda: dae(faces=FACES.replace("2 3</p>", "2 9</p>"))),
    "12 11": ("dae", lambda: dae(points=POINTS[:-2])),
    "geometry #h": ("dae", lambda: dae(scene='<node><instance_geometry url="#h"/></node>')),
    "levels": ("dae", lambda: b"<a>" * 5000),
    f"{MOST_PARTS} 100000": ("dae", lambda: dae(faces='<triangles count="0"/>' * 100_000)),
    "attributes": ("dae", lambda: b"<a " + b"b='' " * 3_000_000 + b"/>"),
    "values": ("gltf", lambda: b"[" + b"[]," * 1_500_000 + b"0]"),
}


@pytest.mark.parametrize(("parts", "case"), HOSTILE.items(), ids=range(len(HOSTILE)))
def test_a_hostile_file_is_refused_before_the_work(parts, case):
    """One line, little memory beside the file, and no time."""
    kind, made = case
    data = made()
    tracemalloc.start()
    begin = time.process_time()
    try:
        with refused(parts, error=Exception):
            read(kind, data)
        assert tracemalloc.get_traced_memory()[1] < 100e6
        assert time.process_time() - begin < 5
    finally:
        tracemalloc.stop()


def sphere(count):
    """Points on a sphere, evenly."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def test_a_hull_of_many_faces_takes_little_memory_and_may_be_refused():
    """16,000 points on a sphere took 3.8 GiB."""
    points = sphere(16_000)
    tracemalloc.start()
    try:
        with refused(f"faces {MOST_FACES}", error=ValueError):
            hull(points, MOST_FACES)
        body = hull(points[::8])
        assert tracemalloc.get_traced_memory()[1] < 400e6
    finally:
        tracemalloc.stop()
    assert np.abs(body(points[::8])).max() < 1e-6


def test_an_obstacle_of_many_faces_parts_or_corners_is_one_line(tmp_path, run):
    mesh = trimesh.convex.convex_hull(sphere(16_000))
    (tmp_path / "ball.obj").write_text(mesh.export(file_type="obj"))
    row = "".join(f"v {i} 0 0\nv {i} 1 0\nv {i} 0 1\n" for i in range(100))
    (tmp_path / "row.obj").write_text(
        row + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 300, 3))
    )
    (tmp_path / "gon.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n30000" + " 0 1 2" * 10_000)
    (tmp_path / "many.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n"
    )
    (tmp_path / "cut.stl").write_bytes(trimesh.creation.box().export(file_type="stl")[:-9])
    for name, parts in {
        "ball.obj": f"faces {MOST_FACES}",
        "row.obj": "100 1 64",
        "gon.off": str(MOST_CORNERS),
        "many.ply": "vertex 4000000000",
        "cut.stl": "cut short 684 675",
    }.items():
        (tmp_path / "scene.toml").write_text(f'[[obstacles]]\nfile = "{name}"\n')
        code, _, err = run("verify", "n1_8_0", "--scene", "scene.toml")
        assert code == 2
        assert has_parts(err, f"scene.toml obstacles[0].file {parts}") or (
            name == "ball.obj" and has_parts(err, 'scene.toml obstacles[0].file "ball.obj"')
        ), err


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off"])
def test_scene_meshes_keep_their_corners(kind):
    made = trimesh.creation.icosphere(1).export(file_type=kind)
    (mesh,) = read_scene_parts(kind, made.encode() if isinstance(made, str) else made).values()
    assert len(mesh.vertices) == 42
    assert mesh.is_watertight
    with pytest.raises(MeshError):
        read_scene_parts(kind, b"")


@settings(max_examples=15)
@given(drawing.seeds)
def test_numbers_of_an_obj_count_back_from_their_face(seed):
    """Negative ones, of several objects, with textures and normals, tabs and continued lines."""
    rng = np.random.default_rng(seed)
    parts, text, first = [solid(rng) for _ in range(2)], b"# made\r\n", 0
    for part in parts:
        text += b"".join(b"v\t%f  %f %f\n" % tuple(v) for v in part.vertices)
        for face in part.faces:
            back = face - len(part.vertices) if rng.uniform() < 0.5 else face + 1 + first
            text += b" f %d/1/2 %d//3 \\\n %d \n" % tuple(back)
        first += len(part.vertices)
    wanted = np.concatenate([np.array(part.triangles) for part in parts])
    assert np.allclose(read_obj(text), wanted, atol=2e-6)
