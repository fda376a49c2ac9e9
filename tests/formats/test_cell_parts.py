"""A cell in one mesh file: its named parts are obstacles and targets, and those that are not wanted
are left out."""

import json
import struct

import numpy as np
import place_rings as pr
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.formats.loader import read_scene
from scipy.spatial.transform import Rotation

from ..support.refusals import refused

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # of z-up points
PARTS = {
    "table": ([0.6, 1.2, 0.2], [0.9, 0.0, -0.1]),
    "fence left": ([2.0, 0.1, 2.0], [0.0, 1.2, 1.0]),
    "fence right": ([2.0, 0.1, 2.0], [0.0, -1.2, 1.0]),
    "walkway": ([0.5, 1.0, 1.8], [1.6, 0.0, 0.9]),
}


def cell(folder, parts=PARTS):
    """Write boxes, each with its size and centre (z-up), as a file that trimesh writes (y-up)."""
    scene = trimesh.Scene()
    for name, (size, centre) in parts.items():
        T = np.eye(4)
        T[:3, 3] = centre
        box = trimesh.creation.box(extents=size, transform=T)
        box.apply_transform(Y_UP)
        scene.add_geometry(box, node_name=name, geom_name=name)
    (folder / "cell.glb").write_bytes(scene.export(file_type="glb"))


def scene_of(folder, text):
    (folder / "scene.toml").write_text(text)
    return read_scene(folder / "scene.toml")


def bounds(obstacle):
    corners = np.array(obstacle.points)
    return corners.min(axis=0), corners.max(axis=0)


coordinate = st.integers(-20, 20).map(lambda n: n / 10)
length = st.integers(1, 20).map(lambda n: n / 10)
boxes = st.dictionaries(
    st.text("abcdé -_", min_size=1, max_size=8).filter(lambda n: n.strip() == n),
    st.tuples(st.tuples(length, length, length), st.tuples(coordinate, coordinate, coordinate)),
    min_size=1,
    max_size=4,
)


@given(parts=boxes)
def test_each_named_part_is_an_obstacle_where_it_stands(tmp_path_factory, parts):
    folder = tmp_path_factory.mktemp("cell")
    cell(folder, parts)
    scene = scene_of(folder, 'obstacles = [{ file = "cell.glb" }]')
    assert {o.name for o in scene.obstacles} == set(parts)
    for obstacle in scene.obstacles:
        size, centre = map(np.array, parts[obstacle.name])
        np.testing.assert_allclose(
            bounds(obstacle), (centre - size / 2, centre + size / 2), atol=1e-6
        )


def test_names_choose_parts_and_leave_others_out(tmp_path):
    cell(tmp_path)
    for patterns, wanted in (
        (["table"], {"table"}),
        (["fence*"], {"fence left", "fence right"}),
        (["fence*", "!*left", "table"], {"fence right", "table"}),
        (["!walkway"], set(PARTS) - {"walkway"}),
        (["*", "!fence*"], {"table", "walkway"}),
    ):
        text = f'obstacles = [{{ file = "cell.glb", parts = {json.dumps(patterns)} }}]'
        assert {o.name for o in scene_of(tmp_path, text).obstacles} == wanted
    for patterns in (["tabel"], ["!chair"], ["table", "!*"]):
        text = f'obstacles = [{{ file = "cell.glb", parts = {json.dumps(patterns)} }}]'
        with refused("scene.toml", "obstacles[0].parts"):
            scene_of(tmp_path, text)
    with refused("scene.toml", "obstacles[0].parts"):
        scene_of(tmp_path, 'obstacles = [{ size = [1, 1, 1], parts = ["a"] }]')


def test_parts_without_a_surface_are_passed_over(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((1, 1, 1)), node_name="table", geom_name="table")
    edges = trimesh.load_path(np.array([[0.0, 0, 0], [1, 1, 1]]))
    scene.add_geometry(edges, node_name="edges", geom_name="edges")
    (tmp_path / "cell.glb").write_bytes(scene.export(file_type="glb"))
    for keys in ("", ', parts = ["!edges"]'):
        made = scene_of(tmp_path, f'obstacles = [{{ file = "cell.glb"{keys} }}]')
        assert [o.name for o in made.obstacles] == ["table"]
    with refused("scene.toml", "obstacles[0].file", "cell.glb"):
        scene_of(tmp_path, 'obstacles = [{ file = "cell.glb", parts = ["edges"] }]')


def test_a_part_is_a_target_too(tmp_path):
    cell(tmp_path)
    scene = scene_of(
        tmp_path,
        'obstacles = [{ file = "cell.glb", parts = ["!walkway"] }]\n'
        '[[targets]]\nname = "people"\n'
        'volume = { kind = "mesh", file = "cell.glb", parts = ["walkway"] }',
    )
    size, centre = map(np.array, PARTS["walkway"])
    assert len(scene.obstacles) == 3
    boxed = pr.Scene(obstacles=scene.obstacles, targets=[pr.Box(size, centre=centre)])
    both = [pr.verify("n1_8_0", s, voxel=0.05).records[0].zeta for s in (scene, boxed)]
    assert both[0] == both[1]
    mesh = pr.Mesh.load(tmp_path / "cell.glb", parts=["walkway"])
    assert set(map(tuple, np.round(mesh.vertices, 6))) == {
        tuple(np.round(centre + size / 2 * s, 6))
        for s in np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    }


def glb(nodes, corners):
    """A GLB by its specification: nodes, and one mesh of a tetrahedron."""
    data = np.array(corners, "<f4").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 12}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


@given(
    turn=st.tuples(*[st.integers(-180, 180)] * 3),
    shift=st.tuples(coordinate, coordinate, coordinate),
)
def test_groups_carry_their_parts_and_name_them(tmp_path_factory, turn, shift):
    folder = tmp_path_factory.mktemp("groups")
    R = Rotation.from_euler("xyz", turn, degrees=True)
    nodes = [
        {"name": "desk", "rotation": R.as_quat().tolist(), "children": [1, 2]},
        {"name": "leg", "translation": list(shift), "mesh": 0},
        {"name": "top", "mesh": 0},
        {"name": "leg", "mesh": 0},
    ]
    (folder / "cell.glb").write_bytes(glb(nodes, TETRAHEDRON[FACES].reshape(-1, 3)))
    whole = scene_of(folder, 'obstacles = [{ file = "cell.glb" }]')
    assert sorted(o.name for o in whole.obstacles) == ["leg", "leg", "top"]
    desk = scene_of(folder, 'obstacles = [{ file = "cell.glb", parts = ["desk", "!*/leg"] }]')
    assert [o.name for o in desk.obstacles] == ["top"]
    (leg,) = scene_of(folder, 'obstacles = [{ file = "cell.glb", parts = ["desk/leg"] }]').obstacles
    x, y, z = R.apply(TETRAHEDRON + np.array(shift)).T
    wanted = np.stack([x, -z, y], axis=1)
    away = np.linalg.norm(np.array(leg.points)[:, None] - wanted, axis=-1)
    assert away.min(axis=0).max() < 1e-6
    assert away.min(axis=1).max() < 1e-6


def test_a_file_without_its_data_is_refused(tmp_path):
    tree = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "buffers": [{"uri": "cell.bin"}]}
    tree["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
    tree["accessors"] = [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}]
    tree["bufferViews"] = [{"buffer": 0, "byteLength": 36}]
    (tmp_path / "cell.gltf").write_text(json.dumps(tree))
    (tmp_path / "cell.bin").write_bytes(bytes(36))
    with refused("scene.toml", "cell.gltf", "cell.bin"):
        scene_of(tmp_path, 'obstacles = [{ file = "cell.gltf" }]')


@pytest.mark.parametrize("data", [b"", b"glTF", b"glTF" + bytes(40)])
def test_a_damaged_file_is_refused(tmp_path, data):
    (tmp_path / "cell.glb").write_bytes(data)
    with pytest.raises(UserError):
        scene_of(tmp_path, 'obstacles = [{ file = "cell.glb" }]')
