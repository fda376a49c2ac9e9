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
from scipy.spatial.transform import Rotation

from .mesh_numbers import AGAIN, MOST_TRIANGLES, MeshError, bounded, picked, placed

_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTH = {"SCALAR": 1, "VEC3": 3}
_MOST_VALUES = 2_000_000  # of a file's text
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive that have a surface
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_UNREADABLE = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization")


def read_gltf(data: bytes, beside: Callable[[str], bytes]) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) m of a glTF file's scene in a frame that is z-up.

    Args:
        data: the file.
        beside: returns the content of a file beside it.

    Raises:
        MeshError: if it lacks a part that it names, has a compression, or too many triangles.
    """
    try:
        return _Gltf(data, beside).triangles()
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"glTF 2.0 as its standard has it ({error!s:.60}); {AGAIN}") from error


class _Gltf:
    def __init__(self, data: bytes, beside: Callable[[str], bytes]) -> None:
        self._beside, self._bytes = beside, dict[int, bytes]()
        text, self._chunk = _chunks(data) if data[:4] == b"glTF" else (data, b"")
        bounded(sum(text.count(mark) for mark in (b",", b"[", b"{")), _MOST_VALUES, "values")
        self._json: dict[str, Any] = json.loads(text)
        for name in self._json.get("extensionsRequired", ()):
            if name in _UNREADABLE:
                raise MeshError(f"glTF without {name}; export it uncompressed")

    def triangles(self) -> Float[np.ndarray, "T 3 3"]:
        """Return the triangles of the scene."""
        instances = self._instances()
        primitives = {mesh: self._json["meshes"][mesh]["primitives"] for _, mesh in instances}
        counts = {m: sum(self._count(p) for p in parts) for m, parts in primitives.items()}
        bounded(sum(counts[mesh] for _, mesh in instances), MOST_TRIANGLES, "triangles")
        shapes = {m: [self._primitive(p) for p in parts] for m, parts in primitives.items()}
        found = [placed(part, _Y_UP @ T) for T, mesh in instances for part in shapes[mesh]]
        return np.concatenate(found) if found else np.zeros((0, 3, 3))

    def _instances(self) -> list[tuple[Float[np.ndarray, "4 4"], int]]:
        """Return the meshes of the scene with their poses; each node stands once, as in a tree."""
        nodes = self._json.get("nodes", [])
        scenes = self._json.get("scenes", [])
        below = {child for node in nodes for child in node.get("children", ())}
        roots = (
            scenes[self._json.get("scene", 0)].get("nodes", [])
            if scenes
            else [i for i in range(len(nodes)) if i not in below]
        )
        stack, seen, found = [(i, np.eye(4)) for i in roots], set[int](), []
        while stack:
            i, T = stack.pop()
            if i in seen or not 0 <= i < len(nodes):
                raise MeshError(f"nodes in a tree (number {i} is not); {AGAIN}")
            seen.add(i)
            T = T @ _pose(nodes[i])
            if "mesh" in nodes[i]:
                found.append((T, int(nodes[i]["mesh"])))
            stack += [(child, T) for child in nodes[i].get("children", ())]
        return found

    def _count(self, primitive: dict[str, Any]) -> int:
        """Return the number of triangles that a primitive states."""
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            return 0
        corners = self._json["accessors"][
            primitive.get("indices", primitive["attributes"]["POSITION"])
        ]["count"]
        return int(corners) // 3 if mode == _TRIANGLES else max(int(corners) - 2, 0)

    def _primitive(self, primitive: dict[str, Any]) -> Float[np.ndarray, "T 3 3"]:
        """Return the triangles of a primitive; none of points and lines."""
        if not (count := self._count(primitive)):
            return np.zeros((0, 3, 3))
        for name in _UNREADABLE:
            if name in primitive.get("extensions", {}):
                raise MeshError(f"glTF without {name}; export it uncompressed")
        points = self._accessor(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
        corners = (
            self._accessor(primitive["indices"], "SCALAR")[:, 0].astype(np.int64)
            if "indices" in primitive
            else np.arange(len(points))
        )
        return picked(points, corners[_order(primitive.get("mode", _TRIANGLES), count)])

    def _accessor(self, i: int, kind: str) -> np.ndarray:
        """Return the values (N, width) of an accessor."""
        accessor = self._json["accessors"][i]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise MeshError("glTF without sparse accessors; export it without them")
        view = self._json["bufferViews"][accessor["bufferView"]]
        if accessor["type"] != kind or accessor["componentType"] not in _TYPES:
            raise MeshError(f"accessors of the type {kind} (one is {accessor['type']}); {AGAIN}")
        dtype = np.dtype(_TYPES[accessor["componentType"]])
        if (dtype.kind == "f") != (kind == "VEC3"):
            raise MeshError(f"points as floats and indices as whole numbers; {AGAIN}")
        size, count = dtype.itemsize * _WIDTH[kind], accessor["count"]
        stride = view.get("byteStride", size)
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        data, end = self._buffer(view["buffer"]), begin + (count - 1) * stride + size
        if min(begin, count - 1, stride - size) < 0 or end > len(data):
            raise MeshError(
                f"a whole file (it is cut short: wants {end} bytes of a buffer, has {len(data)});"
                f" {AGAIN}"
            )
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(data, np.uint8, offset=begin), (count, size), (stride, 1)
        )
        return np.ascontiguousarray(rows).view(dtype)

    def _buffer(self, i: int) -> bytes:
        """Return the content of a buffer: the file's own, in its text, or a file beside it."""
        if i not in self._bytes:
            uri = self._json["buffers"][i].get("uri")
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
    i = np.arange(count)
    if mode == _FAN:
        return np.stack([np.zeros_like(i), i + 1, i + 2], axis=1)
    return np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)


def _pose(node: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """Return the transform (4, 4) of a node in its parent's frame."""
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
