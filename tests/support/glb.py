"""A small reader of GLB for tests, by the specification of glTF 2.0 alone: nodes and animations."""

import json
import struct

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

WIDE = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Glb:
    """Tree and numbers of a GLB."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert (kind, size % 4) == (b"JSON", 0)
        self.tree = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert (kind, rest % 4) == (b"BIN\0", 0)
        self.binary = data[28 + size :]
        assert rest == len(self.binary) >= self.tree["buffers"][0]["byteLength"]
        self.names = [node.get("name") for node in self.tree["nodes"]]

    def numbers(self, accessor: int) -> np.ndarray:
        """The numbers of an accessor, a row each."""
        a = self.tree["accessors"][accessor]
        view = self.tree["bufferViews"][a["bufferView"]]
        assert a["componentType"] == 5126
        assert view["byteOffset"] % 4 == 0
        wide = WIDE[a["type"]]
        data = self.binary[view["byteOffset"] : view["byteOffset"] + 4 * wide * a["count"]]
        values = np.frombuffer(data, "<f4").reshape(-1, wide)
        np.testing.assert_allclose(values.min(axis=0), a["min"], atol=1e-7)
        return values.astype(float)

    def local(self, node: dict) -> np.ndarray:
        """A node's pose in its parent."""
        if "matrix" in node:
            return np.reshape(node["matrix"], (4, 4)).T.astype(float)
        T = np.eye(4)
        T[:3, :3] = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
        T[:3, 3] = node.get("translation", [0, 0, 0])
        return T

    def at(self, time: float) -> dict[str, np.ndarray]:
        """Poses of all nodes in the world at a time of the first animation."""
        nodes = [dict(node) for node in self.tree["nodes"]]
        (animation,) = self.tree["animations"]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            assert sampler["interpolation"] == "LINEAR"
            times, values = self.numbers(sampler["input"])[:, 0], self.numbers(sampler["output"])
            node, path = nodes[channel["target"]["node"]], channel["target"]["path"]
            assert "matrix" not in node
            if path == "rotation":
                turns = Slerp(times, Rotation.from_quat(values))
                node[path] = turns(np.clip(time, times[0], times[-1])).as_quat()
            else:
                node[path] = [np.interp(time, times, v) for v in values.T]
        return self.placed(nodes)

    def placed(self, nodes: list[dict]) -> dict[str, np.ndarray]:
        """Poses of these nodes in the world."""
        there = {}
        waiting = [(i, np.eye(4)) for i in self.tree["scenes"][0]["nodes"]]
        while waiting:
            i, T = waiting.pop()
            there[nodes[i]["name"]] = T @ self.local(nodes[i])
            waiting += [(child, there[nodes[i]["name"]]) for child in nodes[i].get("children", ())]
        return there
