"""Universal Robots' CB3 and e-Series arms other than the reference scene's UR10, and the UR20.

Lengths come from the manufacturer's Denavit-Hartenberg tables, reaches from its data sheets. The
public description (UniversalRobots/Universal_Robots_ROS2_Description, 2.4.5) supplies the lateral
offsets of the links' bodies, which a table sums into one length, and the meshes to which bodies and
mounts were fitted. Frames lie as on the reference UR10: each on its joint's axis, in the middle of
the body that the joint moves, so that the pose curve follows the bodies.

Bodies contain the visual meshes. Those of wrist 3 also contain the meshes where the maker moved
them in 2026 (pull request 393 of the description: 0.5 mm, and 0.55 mm on the UR3, across the
joint's axis), and as far along the axis. Mounts run along the clear tubes of the arms: 0 is where
the housing of one joint ends, 1 where the next one's begins.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..kinematics import Chain, transform
from ..robot import BASE, CapsuleRow, Mount, Robot, bodies_of

_X, _Y, _Z = np.eye(3)
_O = np.zeros(3)
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
LIMITS = np.radians([[-360.0, 360.0]] * 2 + [[-180.0, 180.0]] + [[-360.0, 360.0]] * 3)
_ENDLESS_WRIST = np.vstack([LIMITS[:5], [-np.inf, np.inf]])  # UR3 and UR3e: wrist 3
HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])


class _Lengths(NamedTuple):
    """Lengths of an arm, m, without signs; d1 to d6 are those of the Denavit-Hartenberg table."""

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    upper_arm: float
    """Lateral offset of the upper arm's middle from the base's axis."""
    forearm: float
    """Lateral offset of the forearm's middle from the base's axis."""


class _Tube(NamedTuple):
    """The clear part of a link along its z axis."""

    start: float
    """Lower end, m."""
    end: float
    """Upper end, m."""
    radius: float
    """Radius, m."""


def _arm(
    name: str,
    reach: float,
    size: _Lengths,
    upper_arm: _Tube,
    forearm: _Tube,
    flange: float,
    bodies: tuple[CapsuleRow, ...],
    limits: Float[np.ndarray, "6 2"] = LIMITS,
) -> Robot:
    mounts = tuple(
        Mount(link, frame, tube.start * _Z, _Z, _X, tube.end - tube.start, section=tube.radius)
        for link, frame, tube in (("upper_arm", 1, upper_arm), ("forearm", 2, forearm))
    )
    return Robot(
        name=name,
        chain=Chain(
            joints=JOINTS,
            origin=np.stack(
                [
                    transform((0, 0, size.d1)),
                    transform((0, size.upper_arm, 0), (0, math.pi / 2, 0)),
                    transform((0, size.forearm - size.upper_arm, size.a2)),
                    transform((0, 0, size.a3), (0, math.pi / 2, 0)),
                    transform((0, size.d4 - size.forearm, 0)),
                    transform((0, 0, size.d5)),
                    transform((0, size.d6, 0)),
                ]
            ),
            axis=np.stack([_Z, _Y, _Y, _Y, _Z, _Y]),
        ),
        mounts=(*mounts, Mount("tool", 6, _O, _Y, _X, 0.0, section=flange)),
        reach=reach,
        bodies=bodies_of(bodies),
        limits=limits,
        home=HOME,
        source=f"{name.upper()}: the maker's table; ur_description 2.4.5",
    )


UR3 = _arm(
    "ur3",
    0.5,
    _Lengths(0.1519, 0.24365, 0.21325, 0.11235, 0.08535, 0.0819, 0.1198, 0.0273),
    _Tube(0.078, 0.182, 0.035),
    _Tube(0.058, 0.164, 0.03),
    0.036,
    (
        ("base_0", BASE, (0.0107, -0.0925, 0.0053), (-0.0004, -0.07, 0.0063), 0.0085),
        ("base_1", BASE, (0, -0.0003, 0.031), (0, 0, 0.031), 0.0714),
        ("shoulder", 0, (-0.0012, -0.0002, -0.0194), (0.0001, 0.0068, 0.0012), 0.0658),
        ("upper_arm_0", 1, (0, -0.0111, 0), (0, 0, 0.0158), 0.0711),
        ("upper_arm_1", 1, (0, 0, 0.078), (0, 0, 0.182), 0.0344),
        ("upper_arm_2", 1, (0, 0, 0.2363), (-0.0001, -0.0004, 0.2416), 0.0642),
        ("forearm_0", 2, (0, -0.0001, 0.0321), (0, 0.0345, -0.0001), 0.039),
        ("forearm_1", 2, (0, 0, 0.058), (0, 0, 0.164), 0.029),
        ("forearm_2", 2, (-0.0004, 0.0008, 0.2077), (0.0003, 0.0015, 0.2127), 0.0523),
        ("wrist_1", 3, (0.0005, 0.0807, 0.0007), (0, 0.0828, 0.0014), 0.0523),
        ("wrist_2", 4, (-0.0005, -0.0012, 0.081), (0.0004, 0.0001, 0.083), 0.0521),
        ("wrist_3", 5, (-0.0001, 0.0599, -0.0025), (-0.0002, 0.06, 0.0015), 0.0378),
    ),
    _ENDLESS_WRIST,
)

UR5 = _arm(
    "ur5",
    0.85,
    _Lengths(0.089159, 0.425, 0.39225, 0.10915, 0.09465, 0.0823, 0.13585, 0.01615),
    _Tube(0.085, 0.34, 0.052),
    _Tube(0.062, 0.35, 0.041),
    0.044,
    (
        ("base", BASE, (0, 0, 0.0085), (0, -0.0362, 0.0086), 0.0742),
        ("shoulder", 0, (0, 0.0002, -0.0082), (0, 0.0134, 0), 0.0816),
        ("upper_arm_0", 1, (0, -0.0067, 0), (0, 0, 0.0197), 0.0826),
        ("upper_arm_1", 1, (0, 0, 0.085), (0, 0, 0.34), 0.0506),
        ("upper_arm_2", 1, (0, 0, 0.4053), (0, -0.0068, 0.4249), 0.0826),
        ("forearm_0", 2, (0.0008, 0.007, 0.0249), (0, 0.0428, 0), 0.0595),
        ("forearm_1", 2, (0, 0, 0.062), (0, 0, 0.35), 0.0405),
        ("forearm_2", 2, (0, -0.01, 0.3892), (0, 0.0092, 0.3909), 0.0551),
        ("wrist_1", 3, (-0.0021, 0.0882, -0.0111), (0.0017, 0.0902, 0.0088), 0.0564),
        ("wrist_2", 4, (-0.0003, -0.0026, 0.091), (0, -0.0014, 0.0943), 0.0618),
        ("wrist_3", 5, (0, 0.0616, 0), (0.0001, 0.0617, 0.0033), 0.0402),
    ),
)

UR3E = _arm(
    "ur3e",
    0.5,
    _Lengths(0.15185, 0.24355, 0.2132, 0.13105, 0.08535, 0.0921, 0.12, 0.027),
    _Tube(0.077, 0.185, 0.036),
    _Tube(0.057, 0.164, 0.029),
    0.038,
    (
        ("base", BASE, (0, 0, 0.0364), (0, 0, 0.0364), 0.0739),
        ("shoulder", 0, (0, 0, -0.0052), (0, 0.0114, -0.0001), 0.0685),
        ("upper_arm_0", 1, (0, -0.0001, 0.017), (0, -0.0048, -0.0001), 0.0692),
        ("upper_arm_1", 1, (0, 0, 0.077), (0, 0, 0.185), 0.0351),
        ("upper_arm_2", 1, (0, -0.0002, 0.239), (0, -0.0023, 0.2428), 0.0643),
        ("forearm_0", 2, (0, 0.0205, -0.0007), (-0.0001, 0.0205, -0.0006), 0.0422),
        ("forearm_1", 2, (-0.0002, 0.0003, 0.0344), (-0.0003, 0.002, 0.0343), 0.0373),
        ("forearm_2", 2, (0, 0, 0.057), (0, 0, 0.164), 0.0288),
        ("forearm_3", 2, (0.0003, 0.0022, 0.2088), (0, 0.0062, 0.2126), 0.0543),
        ("wrist_1", 3, (0, 0.095, -0.0004), (0, 0.1041, 0.005), 0.0549),
        ("wrist_2", 4, (0, 0.0168, 0.0851), (0.0001, -0.007, 0.0825), 0.0462),
        ("wrist_3", 5, (0.0001, 0.0703, 0.0015), (0, 0.0708, -0.0001), 0.0379),
    ),
    _ENDLESS_WRIST,
)

UR5E = _arm(
    "ur5e",
    0.85,
    _Lengths(0.1625, 0.425, 0.3922, 0.1333, 0.0997, 0.0996, 0.138, 0.007),
    _Tube(0.095, 0.328, 0.044),
    _Tube(0.091, 0.35, 0.039),
    0.044,
    (
        ("base", BASE, (0, 0, 0.0378), (0, 0, 0.0378), 0.0847),
        ("shoulder", 0, (0.0001, 0.0022, -0.0063), (0, 0.0146, -0.0005), 0.0836),
        ("upper_arm_0", 1, (0, -0.0041, 0.0007), (0, -0.0002, 0.0228), 0.0842),
        ("upper_arm_1", 1, (0, 0, 0.095), (0, 0, 0.328), 0.0435),
        ("upper_arm_2", 1, (0, -0.0002, 0.4033), (0, -0.0133, 0.4245), 0.0869),
        ("forearm_0", 2, (0, -0.0001, 0.0461), (0, 0.0417, -0.0006), 0.0594),
        ("forearm_1", 2, (0, 0, 0.091), (0, 0, 0.35), 0.0389),
        ("forearm_2", 2, (-0.0002, 0.0141, 0.3909), (0.0001, -0.0103, 0.3891), 0.0549),
        ("wrist_1_0", 3, (0, 0.0688, -0.0003), (0, 0.0688, -0.0003), 0.0411),
        ("wrist_1_1", 3, (0, 0.1231, -0.0104), (0, 0.1256, 0.0139), 0.0546),
        ("wrist_2", 4, (0.0003, -0.0075, 0.0962), (-0.0004, 0.0099, 0.0987), 0.0577),
        ("wrist_3", 5, (0.0003, 0.0716, 0.0023), (0, 0.0722, -0.0009), 0.0423),
    ),
)

UR10E = _arm(
    "ur10e",
    1.3,
    _Lengths(0.1807, 0.6127, 0.57155, 0.17415, 0.11985, 0.11655, 0.1762, 0.0393),
    _Tube(0.115, 0.548, 0.059),
    _Tube(0.094, 0.519, 0.046),
    0.046,
    (
        ("base", BASE, (0, 0, 0.0325), (0, 0, 0.0325), 0.1007),
        ("shoulder", 0, (0.001, 0.0058, -0.006), (0, 0.0131, -0.0003), 0.1111),
        ("upper_arm_0", 1, (-0.0005, -0.0582, 0.0284), (0.0001, 0.0139, 0.0746), 0.081),
        ("upper_arm_1", 1, (0, -0.0464, -0.0004), (0.0005, 0.0412, 0.0066), 0.083),
        ("upper_arm_2", 1, (0, 0, 0.115), (0, 0, 0.548), 0.0584),
        ("upper_arm_3", 1, (0.0004, 0.0046, 0.6008), (0, -0.0226, 0.6121), 0.0802),
        ("forearm_0", 2, (0, 0.0386, -0.0009), (0, -0.0002, 0.0577), 0.0619),
        ("forearm_1", 2, (0, 0, 0.094), (0, 0, 0.519), 0.0458),
        ("forearm_2", 2, (0, -0.0033, 0.5637), (0, 0.0207, 0.5706), 0.0644),
        ("wrist_1", 3, (0, 0.1209, -0.0004), (0, 0.135, 0.0116), 0.071),
        ("wrist_2", 4, (0, -0.0021, 0.1125), (0, 0.0203, 0.1193), 0.0652),
        ("wrist_3", 5, (0, 0.0876, -0.001), (0, 0.0878, 0.003), 0.0497),
    ),
)

UR16E = _arm(
    "ur16e",
    0.9,
    _Lengths(0.1807, 0.4784, 0.36, 0.17415, 0.11985, 0.11655, 0.176, 0.04),
    _Tube(0.117, 0.412, 0.059),
    _Tube(0.093, 0.31, 0.046),
    0.046,
    (
        ("base", BASE, (0, 0, 0.0325), (0, 0, 0.0325), 0.1007),
        ("shoulder", 0, (0.001, 0.0058, -0.006), (0, 0.0131, -0.0003), 0.1111),
        ("upper_arm_0", 1, (0.0002, -0.0025, 0.002), (-0.0001, 0, 0.0221), 0.1107),
        ("upper_arm_1", 1, (0, 0, 0.117), (0, 0, 0.412), 0.0584),
        ("upper_arm_2", 1, (-0.0001, -0.0642, 0.4688), (0, -0.0666, 0.478), 0.0592),
        ("upper_arm_3", 1, (0.0001, -0.0065, 0.4723), (-0.0001, 0.0033, 0.4663), 0.0811),
        ("forearm_0", 2, (0, -0.0002, 0.0577), (0, 0.0387, -0.0009), 0.0618),
        ("forearm_1", 2, (0, 0, 0.093), (0, 0, 0.31), 0.0458),
        ("forearm_2", 2, (0.0004, -0.0055, 0.3524), (-0.0019, 0.0253, 0.358), 0.0628),
        ("wrist_1", 3, (0, 0.1202, -0.0004), (0, 0.1343, 0.0116), 0.071),
        ("wrist_2", 4, (0, -0.0021, 0.1125), (0, 0.0203, 0.1193), 0.0652),
        ("wrist_3", 5, (0, 0.0876, -0.001), (0, 0.0878, 0.003), 0.0497),
    ),
)

# The mesh of its upper arm lies 2.1 mm beside the lateral offset that the description states.
UR20 = _arm(
    "ur20",
    1.75,
    _Lengths(0.2363, 0.862, 0.7287, 0.201, 0.1593, 0.1543, 0.2579, 0.043),
    _Tube(0.2, 0.77, 0.0795),
    _Tube(0.2, 0.64, 0.0625),
    0.056,
    (
        ("base", BASE, (0, 0, 0.0219), (0, 0, 0.0219), 0.1246),
        ("shoulder", 0, (0, 0, -0.0424), (0, 0.0485, 0), 0.1243),
        ("upper_arm_0", 1, (0.0004, -0.0001, 0.1003), (0.0001, -0.039, 0.0001), 0.1274),
        ("upper_arm_1", 1, (0, 0, 0.2), (0, 0, 0.77), 0.0797),
        ("upper_arm_2", 1, (0.0005, -0.0003, 0.8378), (0.0005, -0.0477, 0.8616), 0.1015),
        ("forearm_0", 2, (0.0001, 0.0309, 0), (0.0001, 0, 0.1152), 0.1055),
        ("forearm_1", 2, (0, 0, 0.2), (0, 0, 0.64), 0.0627),
        ("forearm_2", 2, (0.0001, 0, 0.6932), (0.0002, 0.0269, 0.7288), 0.0735),
        ("wrist_1", 3, (0, 0.1579, 0.0329), (0.0001, 0.1323, 0), 0.0722),
        ("wrist_2", 4, (0, 0, 0.1349), (-0.0005, 0.035, 0.1581), 0.0713),
        ("wrist_3", 5, (0, 0.1184, 0), (0, 0.1184, 0), 0.0609),
    ),
)
