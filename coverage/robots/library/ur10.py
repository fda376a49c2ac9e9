"""The UR10 (CB3) of the paper as two reference robots: from its public URDF, and from its
Denavit-Hartenberg table.

Each has two descriptions of its links. In the paper's, which serves rings without bodies, mounts
and bodies lie on the lines between the joints. In the other, which serves real rings, mounts run
along the tubes of the public meshes: 0 is where the housing of one joint ends, 1 where the next
one's begins. The tube of the upper arm lies 45.7 mm beside the line between the joints, towards the
robot's middle. Bodies contain the visual meshes, but for a fragment of 1 mm that lies 25 mm beside
the upper arm. That of wrist 3 also contains its mesh where the maker moved it in 2026 (pull request
393 of the description: 1 mm across the joint's axis), and 1 mm along the axis.
"""

import math
from dataclasses import replace

import numpy as np

from ...solids.capsules import Capsules
from ..kinematics import Chain, dh_transform, forward, transform
from ..robot import BASE, Body, Links, Mount, Robot, bodies_of
from .ur import HOME, JOINTS, LIMITS

_X, _Y, _Z = np.eye(3)
_O = np.zeros(3)
_QUARTER = math.pi / 2
_FLANGE = 0.046  # m, radius of the section at the TCP
_SOURCE = "ur_description 2.4.5 (commit 2221ec0), meshes/ur10/visual"

_CHAIN = Chain(
    joints=JOINTS,
    origin=np.stack(
        [
            transform((0, 0, 0.1273)),
            transform((0, 0.220941, 0), (0, _QUARTER, 0)),
            transform((0, -0.1719, 0.612)),
            transform((0, 0, 0.5723), (0, _QUARTER, 0)),
            transform((0, 0.1149, 0)),
            transform((0, 0, 0.1157)),
            transform((0, 0.0922, 0)),
        ]
    ),
    axis=np.stack([_Z, _Y, _Y, _Y, _Z, _Y]),
)
_DH_CHAIN = Chain(
    joints=JOINTS,
    origin=np.stack(
        [
            np.eye(4),
            dh_transform(0.1273, 0, _QUARTER),
            dh_transform(0, -0.612, 0),
            dh_transform(0, -0.5723, 0),
            dh_transform(0.163941, 0, _QUARTER),
            dh_transform(0.1157, 0, -_QUARTER),
            dh_transform(0.0922, 0, 0),
        ]
    ),
    axis=np.stack([_Z] * 6),
)

_TUBES = (
    Mount("upper_arm", 1, np.array([0.0, -0.0457, 0.1006]), _Z, _X, 0.4364, section=0.0549),
    Mount("forearm", 2, np.array([0.0, -0.0007, 0.08]), _Z, _X, 0.448, section=0.0456),
    Mount("tool", 6, _O, _Y, _X, 0.0, section=_FLANGE),
)
_BODIES = bodies_of(
    (
        ("base_0", BASE, (-0.0176, 0.0391, 0.0181), (-0.0176, -0.0394, 0.0184), 0.0609),
        ("base_1", BASE, (0.0526, -0.0593, 0.0188), (0.0528, 0.0596, 0.0187), 0.0297),
        ("shoulder", 0, (0, 0.0118, 0.001), (0, 0.0002, -0.0147), 0.1058),
        ("upper_arm_0", 1, (-0.0001, -0.0591, 0.0016), (0, -0.045, 0.0148), 0.1073),
        ("upper_arm_1", 1, (0, -0.0457, 0.1006), (0, -0.0457, 0.537), 0.0556),
        ("upper_arm_2", 1, (0, -0.0449, 0.5969), (0.0002, -0.0489, 0.6124), 0.0813),
        ("forearm_0", 2, (0, -0.0008, 0.0154), (-0.0011, 0.0125, 0.0034), 0.0821),
        ("forearm_1", 2, (0, -0.0007, 0.08), (0, -0.0007, 0.528), 0.0464),
        ("forearm_2", 2, (0, -0.0083, 0.5671), (0, 0.0199, 0.5733), 0.061),
        ("wrist_1", 3, (0.0006, 0.1078, 0.0004), (-0.0045, 0.114, 0.0173), 0.0669),
        ("wrist_2", 4, (0.0001, -0.0014, 0.1089), (-0.0007, 0.017, 0.113), 0.0656),
        ("wrist_3", 5, (0, 0.0701, 0.001), (0, 0.0701, 0.0002), 0.0463),
    )
)


def _dh_from(frame: int) -> np.ndarray:
    """Return the transform (4, 4) from a frame of the URDF's chain to that of the table's.

    At equal joint angles both chains are the same arm; their bases differ by half a turn.
    """
    turned = transform((0, 0, 0), (0, 0, math.pi))
    if frame == BASE:
        return turned
    T_ur, T_dh = (forward(chain, np.zeros(6))[frame] for chain in (_CHAIN, _DH_CHAIN))
    T: np.ndarray = np.linalg.inv(T_dh) @ turned @ T_ur
    return np.round(T, 12)


def _dh_mount(mount: Mount) -> Mount:
    T = _dh_from(mount.frame)
    start, R = T[:3, :3] @ mount.start + T[:3, 3], T[:3, :3]
    return replace(mount, start=start, axis=R @ mount.axis, zero=R @ mount.zero)


def _dh_body(body: Body) -> Body:
    T = _dh_from(body.frame)
    start, end = (T[:3, :3] @ point + T[:3, 3] for point in (body.capsule.start, body.capsule.end))
    return Body(body.name, body.frame, Capsules(start, end, body.capsule.radius))


# Joint origins of the public UR10 (CB3) URDF.
# The links as lines: radii of the public collision meshes' tubes and housings, on the lines between
# the joints, and thinner than the paper's rings. The base turns about its own axis, so it may be
# attached to the first frame.
_JOINT_LINKS = Links(
    mounts=(
        Mount("upper_arm", 1, _O, _Z, _X, 0.612, section=0.0547),
        Mount("forearm", 2, _O, _Z, _X, 0.5723, section=0.0456),
        Mount("tool", 6, _O, _Y, _X, 0.0, section=0.045),
    ),
    bodies=(
        Body("base", 0, Capsules(-0.0523 * _Z, _O, 0.075)),
        Body("shoulder", 0, Capsules(_O, 0.185 * _Y, 0.075)),
        Body("upper_arm", 1, Capsules(_O, 0.612 * _Z, 0.054)),
        Body("elbow", 1, Capsules(0.612 * _Z, 0.612 * _Z - 0.1719 * _Y, 0.06)),
        Body("forearm", 2, Capsules(_O, 0.5723 * _Z, 0.045)),
        Body("wrist_1", 3, Capsules(_O, 0.1149 * _Y, 0.046)),
        Body("wrist_2", 4, Capsules(_O, 0.1157 * _Z, 0.046)),
        Body("wrist_3", 5, Capsules(_O, 0.0472 * _Y, 0.045)),
    ),
)
UR10 = Robot(
    name="ur10",
    chain=_CHAIN,
    mounts=_JOINT_LINKS.mounts,
    reach=1.3,
    bodies=_JOINT_LINKS.bodies,
    limits=LIMITS,
    home=HOME,
    source=f"UR10 (CB3): ros-industrial/universal_robot; {_SOURCE}",
    tube_links=Links(_TUBES, _BODIES),
    joint_links=_JOINT_LINKS,
)

# Frames of the UR10's (CB3) Denavit-Hartenberg table: the link end points P_0 ... P_6 of the paper.
# The table sums the links' lateral offsets, so that its lines run beside the bodies.
_DH_JOINT_LINKS = Links(
    mounts=(
        Mount("upper_arm", 1, _O, -_X, _Y, 0.612, section=0.0547),
        Mount("forearm", 2, _O, -_X, _Y, 0.5723, section=0.0456),
        Mount("tool", 6, _O, _Z, _X, 0.0, section=0.045),
    ),
    bodies=(
        Body("base", 0, Capsules(0.075 * _Z, 0.1273 * _Z, 0.075)),
        Body("upper_arm", 1, Capsules(_O, -0.612 * _X, 0.054)),
        Body("forearm", 2, Capsules(_O, -0.5723 * _X, 0.045)),
        Body("wrist_1", 3, Capsules(_O, 0.163941 * _Z, 0.046)),
        Body("wrist_2", 4, Capsules(_O, 0.1157 * _Z, 0.046)),
        Body("wrist_3", 5, Capsules(_O, 0.0472 * _Z, 0.045)),
    ),
)
UR10_DH = Robot(
    name="ur10_dh",
    chain=_DH_CHAIN,
    mounts=_DH_JOINT_LINKS.mounts,
    reach=1.3,
    bodies=_DH_JOINT_LINKS.bodies,
    limits=LIMITS,
    home=HOME,
    source=f"UR10 (CB3): the maker's Denavit-Hartenberg table; {_SOURCE}",
    tube_links=Links(tuple(map(_dh_mount, _TUBES)), tuple(map(_dh_body, _BODIES))),
    joint_links=_DH_JOINT_LINKS,
)
