"""The animation of a GLB: the robot's joints along the poses of a scene."""

import json
import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.kinematics import Chain
from ...objectives.poses import Pose

_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_FLOAT = 5126  # glTF's code of 32-bit numbers
_TURN = math.pi / 2  # rad, between two keys, so that a rotation takes the joint's way
_STEP = 1.0  # s, between poses without times


def keys(
    chain: Chain, poses: Sequence[Pose]
) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, "K J"]]:
    """Return times (K,) s from 0 and joint values (K, J), rad or m, which change evenly between.

    Poses follow each other by their times in a recorded motion, or each second. Where a joint turns
    farther than a quarter turn, poses are inserted.
    """
    stated = [pose.time_s for pose in poses]
    times = np.arange(len(poses)) * _STEP
    known = [t for t in stated if t is not None]
    if len(known) == len(poses) and (np.diff(known) > 0).all():
        times = np.array(known) - known[0]
    q = chain.settled(np.stack([pose.q for pose in poses]))
    far = np.abs(np.diff(q, axis=0))[:, ~chain.slides].max(axis=1, initial=0.0)
    at = [np.array([0.0])]
    for k, turn in enumerate(far):
        parts = max(1, math.ceil(turn / _TURN))
        at.append(k + np.arange(1, parts + 1) / parts)
    when, index = np.concatenate(at), np.arange(len(poses))
    values = np.stack([np.interp(when, index, joint) for joint in q.T], axis=1)
    return np.interp(when, index, times), values


def turn_of(
    chain: Chain, joint: int, q: Float[np.ndarray, " K"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 4"]]:
    """Return the translations (K, 3) m and unit quaternions (K, 4), x y z w, of a joint's frame in
    the frame before it, at the joint's values (K,), rad or m."""
    origin, axis = chain.origin[joint], chain.axis[joint]
    R = Rotation.from_matrix(origin[:3, :3])
    if chain.slides[joint]:
        place = origin[:3, 3] + q[:, None] * (origin[:3, :3] @ axis)
        return place, np.tile(R.as_quat(), (len(q), 1))
    turned = (R * Rotation.from_rotvec(q[:, None] * axis)).as_quat()
    flips = np.where((turned[1:] * turned[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    turned[1:] *= np.cumprod(flips)[:, None]  # a quaternion and its negative are one rotation
    return np.tile(origin[:3, 3], (len(q), 1)), turned


def animated(data: bytes, nodes: Sequence[str], chain: Chain, poses: Sequence[Pose]) -> bytes:
    """Return a GLB with an animation that moves the robot through the poses.

    Args:
        data: the GLB.
        nodes: names of the nodes that hold the frames of the chain's joints.
        chain: the chain.
        poses: at least two poses.
    """
    tree, binary = _parts(data)
    times, q = keys(chain, poses)
    number = {node.get("name"): i for i, node in enumerate(tree["nodes"])}
    channels, samplers = list[dict[str, Any]](), list[dict[str, Any]]()
    clock, binary = _accessor(tree, binary, times, "SCALAR")
    for j, name in enumerate(nodes):
        place, turned = turn_of(chain, j, q[:, j])
        node = tree["nodes"][number[name]]
        T = Rotation.from_matrix(np.reshape(node.pop("matrix", np.eye(4)), (4, 4)).T[:3, :3])
        node["rotation"] = T.as_quat().tolist()  # an animated node must not have a matrix
        node["translation"] = place[0].tolist()
        slides = bool(chain.slides[j])
        values, kind = (place, "VEC3") if slides else (turned, "VEC4")
        accessor, binary = _accessor(tree, binary, values, kind)
        target = {"node": number[name], "path": "translation" if slides else "rotation"}
        channels.append({"sampler": len(samplers), "target": target})
        samplers.append({"input": clock, "output": accessor, "interpolation": "LINEAR"})
    tree["animations"] = [{"name": "poses", "channels": channels, "samplers": samplers}]
    tree["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = _CHUNK.pack(len(text), b"JSON") + text + _CHUNK.pack(len(binary), b"BIN\0") + binary
    return _HEAD.pack(b"glTF", 2, _HEAD.size + len(chunks)) + chunks


def _parts(data: bytes) -> tuple[Any, bytes]:
    """Return the tree and the binary chunk of a GLB."""
    length, _ = _CHUNK.unpack_from(data, _HEAD.size)
    at = _HEAD.size + _CHUNK.size
    return json.loads(data[at : at + length]), data[at + length + _CHUNK.size :]


def _accessor(
    tree: Any, binary: bytes, values: Float[np.ndarray, "..."], kind: str
) -> tuple[int, bytes]:
    """Add numbers to the binary chunk; return the number of their accessor, and the chunk."""
    packed = np.asarray(values, "<f4")
    binary += b"\0" * (-len(binary) % 4)
    view = {"buffer": 0, "byteOffset": len(binary), "byteLength": packed.nbytes}
    tree["bufferViews"].append(view)
    flat = packed.reshape(len(packed), -1)
    accessor = {
        "bufferView": len(tree["bufferViews"]) - 1,
        "componentType": _FLOAT,
        "count": len(flat),
        "type": kind,
        "min": flat.min(axis=0).tolist(),
        "max": flat.max(axis=0).tolist(),
    }
    tree["accessors"].append(accessor)
    return len(tree["accessors"]) - 1, binary + packed.tobytes()
