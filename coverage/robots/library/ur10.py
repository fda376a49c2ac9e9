"""The UR10 (CB3) of the paper as two reference robots: from its public URDF, and from its
Denavit-Hartenberg table.

Their mount axes run from joint to joint, as the paper's rings do. ``usable`` and ``section`` state
where, and around what, a real ring can be closed, according to the tubes of the public meshes
(ur_description). The tube of the upper arm lies 4.6 cm beside the axis, towards the robot's middle.
"""

import math

import numpy as np

from ...solids.capsules import Capsules
from ..kinematics import Chain, dh_transform, transform
from ..robot import Body, Mount, Robot

_X, _Y, _Z = np.eye(3)
_O = np.zeros(3)
_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_QUARTER = math.pi / 2
_LIMITS = np.radians([[-360.0, 360.0]] * 2 + [[-180.0, 180.0]] + [[-360.0, 360.0]] * 3)
_HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
_UPPER_ARM, _FOREARM, _TOOL, _ASIDE = (0.166, 0.874), (0.141, 0.922), 0.045, 0.046
_SOURCE = "UR10 (CB3): ros-industrial/universal_robot, ur_description"

# Joint origins of the public UR10 (CB3) URDF. The mounts are the centrelines of the links' bodies.
UR10 = Robot(
    name="ur10",
    chain=Chain(
        joints=_JOINTS,
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
    ),
    mounts=(
        Mount("upper_arm", 1, _O, _Z, _X, 0.612, _UPPER_ARM, 0.0547, _ASIDE, -_QUARTER),
        Mount("forearm", 2, _O, _Z, _X, 0.5723, _FOREARM, 0.0456),
        Mount("tool", 6, _O, _Y, _X, 0.0, (0.0, 1.0), _TOOL),
    ),
    reach=1.3,
    # Radii of the public collision meshes' tubes and housings, on the mounts' axes: thinner than
    # the paper's rings. The base turns about its own axis, so it may be attached to the first
    # frame.
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
    limits=_LIMITS,
    home=_HOME,
    source=_SOURCE,
)

# Frames of the UR10's (CB3) Denavit-Hartenberg table: the link end points P_0 ... P_6 of the paper.
UR10_DH = Robot(
    name="ur10_dh",
    chain=Chain(
        joints=_JOINTS,
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
    ),
    mounts=(
        Mount("upper_arm", 1, _O, -_X, _Y, 0.612, _UPPER_ARM, 0.0547, _ASIDE, _QUARTER),
        Mount("forearm", 2, _O, -_X, _Y, 0.5723, _FOREARM, 0.0456),
        Mount("tool", 6, _O, _Z, _X, 0.0, (0.0, 1.0), _TOOL),
    ),
    reach=1.3,
    # The same radii on the lines between the link end points, as this chain omits the links'
    # lateral offsets.
    bodies=(
        Body("base", 0, Capsules(0.075 * _Z, 0.1273 * _Z, 0.075)),
        Body("upper_arm", 1, Capsules(_O, -0.612 * _X, 0.054)),
        Body("forearm", 2, Capsules(_O, -0.5723 * _X, 0.045)),
        Body("wrist_1", 3, Capsules(_O, 0.163941 * _Z, 0.046)),
        Body("wrist_2", 4, Capsules(_O, 0.1157 * _Z, 0.046)),
        Body("wrist_3", 5, Capsules(_O, 0.0472 * _Z, 0.045)),
    ),
    limits=_LIMITS,
    home=_HOME,
    source="UR10 (CB3): the maker's Denavit-Hartenberg table",
)
