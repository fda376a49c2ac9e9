"""Reader of the surfaces in glTF 2.0 meshes (.gltf and .glb): the triangles of a file's scene.

glTF is y-up by its standard, and a link's frame is z-up: (x, y, z) becomes (x, -z, y). Materials
and textures are not read.
"""

import base64
import binascii
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...coverage.definitions.errors import shown
from .mesh_numbers import (
    AGAIN,
    MOST_PARTS,
    MOST_TRIANGLES,
    Y_UP,
    MeshError,
    bounded,
    picked,
    placed,
    strips,
)

_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTH = {"SCALAR": 1, "VEC3": 3}
_MOST_VALUES = 2_000_000  # of a file's text
_LONGEST = 1000  # characters of a part's name
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive that have a surface
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
_NO_SHAPE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
_ODD = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


def read_gltf(data: bytes, beside: Callable[[str], bytes]) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) m of a glTF file's scene in a frame that is z-up.

    Args:
        data: the file.
        beside: returns the content of a file beside it.

    Raises:
        MeshError: if it lacks a part that it names, has a compression, or too many triangles.
    """
    parts = list(gltf_parts(data, beside).values())
    return np.concatenate(parts) if parts else np.zeros((0, 3, 3))


def gltf_parts(
    data: bytes, beside: Callable[[str], bytes]
) -> dict[str, Float[np.ndarray, "T 3 3"]]:
    """Return the triangles (T, 3, 3) m of each part of a glTF file's scene, as ``read_gltf`` does.

    A part is a node with a mesh. Its name has the names of the nodes from the root to it, with a /
    between them. Parts of the same name are one.
    """
    try:
        return _Gltf(data, beside).parts()
    except _ODD as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"glTF 2.0 as its standard has it ({error!s:.60}); {AGAIN}") from error


class _Gltf:
    def __init__(self, data: bytes, beside: Callable[[str], bytes]) -> None:
        self._beside, self._bytes = beside, dict[int, bytes]()
        text, self._chunk = _chunks(data) if data[:4] == b"glTF" else (data, b"")
        bounded(sum(text.count(mark) for mark in (b",", b"[", b"{")), _MOST_VALUES, "values")
        self._json: dict[str, Any] = json.loads(text)
        version = self._json.get("asset", {}).get("version")
        if not str(version).startswith("2."):
            raise MeshError(f"glTF 2.0 (its version is {shown(version)}); {AGAIN}")
        for name in self._json.get("extensionsRequired", ()):
            if not name.startswith(_NO_SHAPE):
                raise MeshError(f"glTF that does not require {name:.60}; export it without that")
        self._values: dict[int, np.ndarray] = {}

    def parts(self) -> dict[str, Float[np.ndarray, "T 3 3"]]:
        """Return the triangles of the scene's parts, by their names."""
        instances = self._instances()
        primitives = {mesh: self._item("meshes", mesh)["primitives"] for *_, mesh in instances}
        bounded(sum(len(primitives[mesh]) for *_, mesh in instances), MOST_PARTS, "surfaces")
        counts = {m: sum(self._count(p) for p in parts) for m, parts in primitives.items()}
        bounded(sum(counts[mesh] for *_, mesh in instances), MOST_TRIANGLES, "triangles")
        shapes = {m: [self._primitive(p) for p in parts] for m, parts in primitives.items()}
        found: dict[str, list[np.ndarray]] = {}
        for name, T, mesh in instances:
            found.setdefault(name, []).extend(placed(part, Y_UP @ T) for part in shapes[mesh])
        return {name: np.concatenate(parts) for name, parts in found.items() if parts}

    def _instances(self) -> list[tuple[str, Float[np.ndarray, "4 4"], int]]:
        """Return the meshes of the scene with names and poses; each node stands once, as in a
        tree."""
        nodes = self._json.get("nodes", [])
        bounded(len(nodes), MOST_PARTS, "nodes")
        scenes = self._json.get("scenes", [])
        below = {child for node in nodes for child in node.get("children", ())}
        roots = (
            self._item("scenes", self._json.get("scene", 0)).get("nodes", [])
            if scenes
            else [i for i in range(len(nodes)) if i not in below]
        )
        stack, seen, placed_meshes = [(i, "", np.eye(4)) for i in roots], set[int](), []
        while stack:
            i, above, T = stack.pop()
            if i in seen or not 0 <= i < len(nodes):
                raise MeshError(f"nodes in a tree (number {i} is not); {AGAIN}")
            seen.add(i)
            T, name = T @ _pose(nodes[i]), f"{above}/{nodes[i].get('name') or i}"[:_LONGEST]
            if "mesh" in nodes[i]:
                placed_meshes.append((name.lstrip("/"), T, nodes[i]["mesh"]))
            stack += [(child, name, T) for child in nodes[i].get("children", ())]
        return placed_meshes

    def _count(self, primitive: dict[str, Any]) -> int:
        """Return the number of triangles that a primitive states."""
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            return 0
        accessor = primitive.get("indices", primitive["attributes"]["POSITION"])
        corners = self._item("accessors", accessor)["count"]
        return int(corners) // 3 if mode == _TRIANGLES else max(int(corners) - 2, 0)

    def _primitive(self, primitive: dict[str, Any]) -> Float[np.ndarray, "T 3 3"]:
        """Return the triangles of a primitive; none of points and lines."""
        if not (count := self._count(primitive)):
            return np.zeros((0, 3, 3))
        for name in _COMPRESSED:
            if name in primitive.get("extensions", {}):
                raise MeshError(f"glTF without {name}; export it uncompressed")
        points = self._accessor(primitive["attributes"]["POSITION"], "VEC3")
        corners = (
            self._accessor(primitive["indices"], "SCALAR")[:, 0]
            if "indices" in primitive
            else np.arange(len(points))
        )
        return picked(points, corners[_order(primitive.get("mode", _TRIANGLES), count)])

    def _item(self, kind: str, i: int) -> Any:
        """Return the element of a list of the file that has a number, from 0."""
        if not isinstance(i, int) or i < 0:
            raise MeshError(f"{kind} by their numbers (one is {shown(i)}); {AGAIN}")
        return self._json[kind][i]

    def _accessor(self, i: int, kind: str) -> np.ndarray:
        """Return the values (N, width) of an accessor; each is read once."""
        accessor = self._item("accessors", i)
        if accessor["type"] != kind or accessor["componentType"] not in _TYPES:
            raise MeshError(
                f"accessors of the type {kind} (one is {shown(accessor['type'])} of"
                f" {shown(accessor['componentType'])}); {AGAIN}"
            )
        if i not in self._values:
            read = sum(map(len, self._values.values()))
            bounded(read + accessor["count"], 6 * MOST_TRIANGLES, "points and corners")
            self._values[i] = self._read(accessor)
        return self._values[i]

    def _read(self, accessor: dict[str, Any]) -> np.ndarray:
        """Return the values (N, width) of an accessor from its buffer."""
        if "sparse" in accessor or "bufferView" not in accessor:
            raise MeshError("glTF without sparse accessors; export it without them")
        view, kind = self._item("bufferViews", accessor["bufferView"]), accessor["type"]
        dtype = np.dtype(_TYPES[accessor["componentType"]])
        if (dtype.kind == "f") != (kind == "VEC3"):
            raise MeshError(f"points as floats and indices as whole numbers; {AGAIN}")
        size, count = dtype.itemsize * _WIDTH[kind], accessor["count"]
        stride = view.get("byteStride", size)
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        data, end = self._buffer(view["buffer"]), begin + (count - 1) * stride + size
        if min(begin, count - 1, stride - size) < 0 or end > len(data):
            raise MeshError(
                f"a whole file (it is cut short: wants {shown(end)} bytes of a buffer, has"
                f" {len(data)}); {AGAIN}"
            )
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(data, np.uint8, offset=begin), (count, size), (stride, 1)
        )
        values = np.ascontiguousarray(rows).view(dtype)
        return values.astype(np.float64 if kind == "VEC3" else np.int64)

    def _buffer(self, i: int) -> bytes:
        """Return the content of a buffer: the file's own, in its text, or a file beside it."""
        if i not in self._bytes:
            uri = self._item("buffers", i).get("uri")
            if uri is None:
                self._bytes[i] = self._chunk
            elif uri.startswith("data:"):
                try:
                    self._bytes[i] = base64.b64decode(uri.partition(",")[2], validate=True)
                except binascii.Error as error:
                    raise MeshError(f"buffers in base64 ({error}); {AGAIN}") from error
            else:
                self._bytes[i] = self._beside(uri)
        return self._bytes[i]


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """Return the text and the binary chunk of a GLB file."""
    if (version := int.from_bytes(data[4:8], "little")) != 2:
        raise MeshError(f"GLB 2 (its version is {version}); {AGAIN}")
    length = int.from_bytes(data[8:12], "little")
    if len(data) < max(length, 20):
        raise MeshError(
            f"a whole file (it is cut short: wants {max(length, 20)} bytes, has {len(data)});"
            f" {AGAIN}"
        )
    size = int.from_bytes(data[12:16], "little")
    return data[20 : 20 + size], data[28 + size : length]


def _order(mode: int, count: int) -> Int[np.ndarray, "T 3"]:
    """Return the numbers (T, 3) of the corners of each triangle of a primitive."""
    if mode == _TRIANGLES:
        return np.arange(3 * count).reshape(-1, 3)
    if mode == _STRIP:
        return strips(np.array([count + 2]))
    i = np.arange(count)
    return np.stack([np.zeros_like(i), i + 1, i + 2], axis=1)


def _pose(node: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """Return the transform (4, 4) of a node in its parent's frame."""
    from scipy.spatial.transform import Rotation  # most commands read no such file

    T = np.eye(4)
    if "matrix" in node:  # by columns
        T = np.array(node["matrix"], float).reshape(4, 4).T
    else:
        turn = np.array(node.get("rotation", [0, 0, 0, 1]), float)
        R = Rotation.from_quat(turn).as_matrix()
        T[:3, :3] = R * np.array(node.get("scale", [1, 1, 1]), float).reshape(3)
        T[:3, 3] = np.array(node.get("translation", [0, 0, 0]), float).reshape(3)
    if not np.isfinite(T).all() or math.isclose(float(np.abs(T).max()), 0):
        raise MeshError(f"nodes of finite transforms; {AGAIN}")
    return T
