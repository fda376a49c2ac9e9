"""glTF and COLLADA of many parts, and glTF with any value in any place: a mesh or one line, in
little time. Nothing that a file does not state is read.
"""

import json
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.formats.mesh_readers.gltf import read_gltf
from place_rings.formats.mesh_readers.mesh_numbers import MOST_PARTS, MeshError
from place_rings.formats.mesh_readers.stl import read_stl

from ..support.refusals import refused
from .test_mesh_readers import CORNERS, FACES, GEOMETRY, INDEX, POINTS, collada, dae, gltf

SHAPE_FREE = ["KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp"]
SHAPING = ["EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "EXT_meshopt_compression", "OWN_x"]
ODD = st.sampled_from(
    [-1, 10**400, 10**30, 1e300, float("nan"), "0", "\ud800", "X" * 5000, True, None, [], {}, [[]]]
)


def places(value, path=()):
    """The paths of all values within a JSON value."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inside in items:
        yield (*path, key)
        if isinstance(inside, dict | list):
            yield from places(inside, (*path, key))


def read(file, data):
    return read_gltf(json.dumps(file).encode(), lambda uri: data)


@settings(max_examples=150)
@given(st.data(), ODD)
def test_a_gltf_with_an_odd_value_anywhere_is_a_mesh_or_one_line(data, odd):
    """A matrix of integers beyond a float, a stride beyond 64 bits and others were tracebacks."""
    content, file = gltf(CORNERS, INDEX)
    node = {"mesh": 0, "translation": [0, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}
    file["nodes"] = [node, {"matrix": np.eye(4).ravel().tolist(), "children": [0]}]
    file["scenes"] = [{"nodes": [1]}]
    file["bufferViews"][0]["byteStride"] = 12
    *path, last = data.draw(st.sampled_from(list(places(file))))
    inside = file
    for key in path:
        inside = inside[key]
    inside[last] = odd
    said = ""
    try:
        found = read(file, content)
    except MeshError as error:
        said = str(error)
    else:
        assert found.shape in ((len(INDEX) // 3, 3, 3), (0, 3, 3))
    assert len(said) < 300


@pytest.mark.parametrize(
    ("kind", "path"),
    [
        ("meshes", ("nodes", 0, "mesh")),
        ("accessors", ("meshes", 0, "primitives", 0, "indices")),
        ("bufferViews", ("accessors", 0, "bufferView")),
        ("buffers", ("bufferViews", 0, "buffer")),
        ("scenes", ("scene",)),
    ],
)
@given(back=st.integers(-9, -1))
def test_a_number_below_0_counts_nothing_from_the_end(kind, path, back):
    content, file = gltf(CORNERS, INDEX)
    inside = file
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = back
    with refused(f"{kind} {back}", error=MeshError):
        read(file, content)


@given(st.lists(st.sampled_from(SHAPE_FREE + SHAPING), max_size=4))
def test_only_required_extensions_without_a_shape_are_passed_over(names):
    content, file = gltf(CORNERS, INDEX, extensionsRequired=names)
    odd = [name for name in names if name in SHAPING]
    if odd:
        with refused(odd[0], error=MeshError):
            read(file, content)
    else:
        assert len(read(file, content)) == 4


@pytest.mark.parametrize("version", ["1.0", "3.0", 2, None])
def test_other_versions_of_gltf_are_named(version):
    content, file = gltf(CORNERS, INDEX, asset={"version": version})
    with refused("2.0", error=MeshError):
        read(file, content)
    with refused("GLB 1", error=MeshError):
        read_gltf(b"glTF" + (1).to_bytes(4, "little") + bytes(100), lambda uri: b"")


def test_surfaces_that_share_their_points_read_them_once():
    """2,000 of 800,000 points took minutes, and 700,000 lists of corners more than 40 s."""
    many = np.zeros((200_000, 3))
    many[: len(CORNERS)] = CORNERS
    content, file = gltf(many, INDEX)
    file["bufferViews"][1]["byteOffset"] = many.size * 4
    file["accessors"][1]["componentType"] = 5123
    file["meshes"][0]["primitives"] *= 2000
    content = many.astype("<f4").tobytes() + np.asarray(INDEX, "<u2").tobytes()
    begin = time.process_time()
    assert len(read(file, content)) == 2000 * 4
    text = dae(points=POINTS + " 0" * 300_000, faces=FACES * 500)
    assert len(collada(text)) == 500 * 4
    vertex = '<input semantic="VERTEX" source="#v" offset="0"/>'
    lists = "<p>0 1 2</p>" * 50_000
    for tag in ("polygons", "tristrips", "trifans"):
        assert len(collada(dae(faces=f"<{tag}>{vertex}{lists}</{tag}>"))) == 50_000
    assert time.process_time() - begin < 3


def test_many_nodes_and_surfaces_are_refused_before_the_work():
    """600,000 nodes in each other took 24 s."""
    content, file = gltf(CORNERS, INDEX)
    chain = [{"children": [i + 1]} for i in range(30_000)]
    flat = [{"mesh": 0}] * (MOST_PARTS // 10)
    parts = [{"primitives": file["meshes"][0]["primitives"] * 20}]
    begin = time.process_time()
    for change in (
        {"nodes": [*chain, {"mesh": 0}]},
        {"nodes": flat, "scenes": [{"nodes": list(range(len(flat)))}], "meshes": parts},
    ):
        with refused(f"{MOST_PARTS}", error=MeshError):
            read({**file, **change}, content)
    with refused(f"{MOST_PARTS}", error=MeshError):
        collada(dae(faces=FACES * (MOST_PARTS + 1)))
    with refused(f"{MOST_PARTS}", error=MeshError):
        collada(dae(scene=f"<node>{GEOMETRY * (MOST_PARTS + 1)}</node>"))
    assert time.process_time() - begin < 5


@given(
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.booleans(),
    st.sampled_from(["", "\ufeff", "\n ", "\ufeff \n"]),
    st.sampled_from(["", " a part"]),
)
def test_a_text_stl_may_have_any_line_ends_case_and_a_byte_order_mark(end, upper, before, name):
    corners = np.array(CORNERS, float)[np.reshape(INDEX, (-1, 3))]
    lines = [f"solid{name}"]
    for triangle in corners:
        points = [f"vertex {x:e} {y:e} {z:e}" for x, y, z in triangle]
        lines += ["facet normal 0 0 0", "outer loop", *points, "endloop", "endfacet"]
    text = end.join([*lines, f"endsolid{name}", ""])
    found = read_stl((before + (text.upper() if upper else text)).encode())
    assert np.array_equal(found, corners)
