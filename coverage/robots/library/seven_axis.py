"""Seven-axis arms: Franka's Panda (FER) and FR3, and KUKA's LBR iiwa 14 R820.

Chains, limits and meshes come from public descriptions: the Panda's from franka_ros
(franka_description, as in example-robot-data), the FR3's from frankarobotics/franka_description,
the iiwa's from IFL-CAMP/iiwa_stack (iiwa_description). Reaches come from the data sheets. The TCP
is the flange, without a hand.

Franka publishes several sets of joint limits for the FR3; joint 1 is given here as an example. The
built-in robot has those of franka_description's robots/fr3/joint_limits.yaml (+-2.7437 rad). The
later system limits in the specifications of the control interface (frankarobotics/docs,
control-parameters-joint-fr3.csv) are wider (+-2.9007). The ranges that these suggest to planners
with a constant speed limit are narrower: +-2.3476 in control-parameters-joint-fr3-rectangular.csv,
+-2.3093 in descriptions made from an earlier edition.

Bodies contain the visual meshes. Mounts run along the parts of the arms around which a ring can be
closed. On the Frankas these are the tube above the shoulder (upper arm) and the neck before the
wrist (forearm). The FR3 has the Panda's mounts; its bodies contain the visual meshes of both arms,
and the collision meshes of its links 0, 6 and 7. On the iiwa they are the tube of link 2 above the
shoulder, and the neck of link 5.
"""

import math

import numpy as np

from ..kinematics import Chain, transform
from ..robot import BASE, CapsuleRow, Mount, Robot, bodies_of

_QUARTER = math.pi / 2
_Z = np.eye(3)[2]
_O = np.zeros(3)


def _unit(*v: float) -> np.ndarray:
    unit: np.ndarray = np.array(v) / np.linalg.norm(v)
    return unit


_FRANKA = np.stack(
    [
        transform((0, 0, 0.333)),
        transform((0, 0, 0), (-_QUARTER, 0, 0)),
        transform((0, -0.316, 0), (_QUARTER, 0, 0)),
        transform((0.0825, 0, 0), (_QUARTER, 0, 0)),
        transform((-0.0825, 0.384, 0), (-_QUARTER, 0, 0)),
        transform((0, 0, 0), (_QUARTER, 0, 0)),
        transform((0.088, 0, 0), (_QUARTER, 0, 0)),
        transform((0, 0, 0.107)),
    ]
)
_FRANKA_MOUNTS = (
    Mount(
        "upper_arm",
        1,
        np.array([0.0, -0.0713, 0.0226]),
        _unit(0, -0.9692, -0.2462),
        np.eye(3)[0],
        0.125,
        section=0.0618,
    ),
    Mount(
        "forearm",
        4,
        np.array([0.0, 0.0767, -0.1517]),
        _unit(0, 0.2158, 0.9764),
        np.eye(3)[0],
        0.087,
        section=0.0364,
    ),
    Mount("tool", 7, _O, _Z, np.eye(3)[0], 0.0, section=0.091),
)
_FRANKA_HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 100.0, 45.0])


def _joints(prefix: str) -> tuple[str, ...]:
    return tuple(f"{prefix}joint{i}" for i in range(1, 8))


def _symmetric(*limits: float) -> np.ndarray:
    return np.stack([-np.array(limits), np.array(limits)], axis=1)


_PANDA_BODIES: tuple[CapsuleRow, ...] = (
    ("link0", BASE, (-0.0572, 0, 0.0208), (0, 0, 0.0506), 0.1052),
    ("link1_0", 0, (0, 0, -0.1619), (0.0002, -0.008, -0.1336), 0.063),
    ("link1_1", 0, (0.0001, -0.06, -0.0499), (0, -0.0128, -0.076), 0.0619),
    ("link1_2", 0, (0.0001, -0.0651, 0.0009), (-0.0001, -0.0337, -0.0001), 0.0647),
    ("link2_0", 1, (0, 0, 0.0532), (0, -0.0233, 0.0475), 0.0765),
    ("link2_1", 1, (0, -0.0713, 0.0226), (0, -0.1925, -0.0082), 0.0622),
    ("link2_2", 1, (-0.0444, -0.1875, -0.0396), (0.0446, -0.1874, -0.0396), 0.0171),
    ("link2_3", 1, (-0.0529, -0.1913, -0.0134), (0.0529, -0.1913, -0.0134), 0.012),
    ("link3", 2, (0.0003, 0.0001, -0.0796), (0.0825, 0.0424, 0), 0.0694),
    ("link4", 3, (0, 0, 0.0424), (-0.0812, 0.084, 0.0001), 0.0694),
    ("link5_0", 4, (0, 0, -0.2339), (-0.0059, 0.0614, -0.1943), 0.0607),
    ("link5_1", 4, (0, 0.0767, -0.1517), (0, 0.0955, -0.0668), 0.0361),
    ("link5_2", 4, (0, 0.0943, 0.0011), (0, 0.0958, -0.0284), 0.0515),
    ("link5_3", 4, (-0.0001, 0.0412, 0), (-0.0001, 0.0618, 0.0132), 0.0546),
    ("link6", 5, (0.0222, 0.009, 0.0054), (0.088, 0.0091, 0), 0.0749),
    ("link7", 6, (-0.0052, -0.0052, 0.0731), (0.0329, 0.0329, 0.0813), 0.0495),
)
_FR3_BODIES: tuple[CapsuleRow, ...] = (
    ("link0", BASE, (-0.0573, -0.0008, 0.0242), (-0.0009, -0.0001, 0.0513), 0.1065),
    ("link1_0", 0, (0, 0, -0.1579), (0.0001, -0.0025, -0.1533), 0.065),
    ("link1_1", 0, (0, -0.0576, -0.0377), (0, -0.0013, -0.0943), 0.0621),
    ("link1_2", 0, (0.0009, -0.0653, 0.0008), (-0.0008, -0.0322, -0.0004), 0.0645),
    ("link2_0", 1, (0, 0, 0.0532), (0, -0.0232, 0.0474), 0.0765),
    ("link2_1", 1, (0, -0.0713, 0.0226), (0, -0.1925, -0.0082), 0.0622),
    ("link2_2", 1, (0.0446, -0.1874, -0.0396), (-0.0445, -0.1874, -0.0396), 0.0171),
    ("link2_3", 1, (-0.0528, -0.1913, -0.0134), (0.0528, -0.1912, -0.0133), 0.0121),
    ("link3", 2, (0.0827, 0.0426, 0.0014), (0.0028, 0.0001, -0.0821), 0.0699),
    ("link4", 3, (0, 0, 0.0427), (-0.0814, 0.0839, 0.001), 0.0696),
    ("link5_0", 4, (0.0001, 0.0506, -0.1876), (0, 0, -0.2355), 0.0601),
    ("link5_1", 4, (0, 0.0767, -0.1517), (0, 0.0955, -0.0668), 0.0367),
    ("link5_2", 4, (0, 0.0985, -0.0272), (0, 0.0915, 0.0029), 0.0519),
    ("link5_3", 4, (-0.0001, 0.0462, 0.0009), (0, 0.0468, -0.0017), 0.0571),
    ("link6", 5, (0.0229, 0.0066, 0.0038), (0.0863, 0.0084, -0.0019), 0.0759),
    ("link7", 6, (-0.005, -0.0048, 0.0732), (0.0342, 0.0342, 0.0747), 0.05),
)
_IIWA_BODIES: tuple[CapsuleRow, ...] = (
    ("link_0", BASE, (0, 0, 0.0554), (-0.0376, -0.0016, 0.0669), 0.1336),
    ("link_1_0", 0, (0, -0.0061, 0.0098), (0, 0, 0.0094), 0.0863),
    ("link_1_1", 0, (0, -0.0423, 0.0959), (0.0001, -0.005, 0.0468), 0.0842),
    ("link_1_2", 0, (-0.0393, -0.0521, 0.158), (0.0381, -0.0514, 0.1595), 0.0631),
    ("link_1_3", 0, (0, -0.0355, 0.1958), (-0.0002, -0.0148, 0.2031), 0.0875),
    ("link_2_0", 1, (0.0004, -0.0009, 0.0386), (0, 0.0334, 0.0524), 0.0942),
    ("link_2_1", 1, (0, 0.0927, 0.0461), (0, 0.2099, -0.0103), 0.071),
    ("link_2_2", 1, (-0.0561, 0.1965, -0.044), (0.0571, 0.1967, -0.0441), 0.0254),
    ("link_3", 2, (0, 0, 0.0396), (0, 0.0404, 0.2167), 0.079),
    ("link_4", 3, (0, -0.0012, 0.041), (0.0002, 0.145, 0.001), 0.0798),
    ("link_5_0", 4, (0, 0, 0.0249), (0.0002, 0.0229, 0.0562), 0.0727),
    ("link_5_1", 4, (0, 0.0613, 0.0994), (0, 0.083, 0.1702), 0.0445),
    ("link_5_2", 4, (0, 0.0684, 0.2155), (0, 0.0727, 0.2003), 0.0522),
    ("link_6", 5, (0, -0.0157, -0.0004), (0, 0.021, 0), 0.0796),
    ("link_7", 6, (0, 0, 0.0065), (0, 0, 0.0065), 0.0525),
)

PANDA = Robot(
    name="panda",
    chain=Chain(_joints("panda_"), _FRANKA, np.stack([_Z] * 7)),
    mounts=_FRANKA_MOUNTS,
    reach=0.855,
    bodies=bodies_of(_PANDA_BODIES),
    limits=np.array(
        [
            [-2.8973, 2.8973],
            [-1.7628, 1.7628],
            [-2.8973, 2.8973],
            [-3.0718, -0.0698],
            [-2.8973, 2.8973],
            [-0.0175, 3.7525],
            [-2.8973, 2.8973],
        ]
    ),
    home=_FRANKA_HOME,
    source="Franka Emika Panda: franka_ros, franka_description; data sheet",
)

FR3 = Robot(
    name="fr3",
    chain=Chain(_joints("fr3_"), _FRANKA, np.stack([_Z] * 7)),
    mounts=_FRANKA_MOUNTS,
    reach=0.855,
    bodies=bodies_of(_FR3_BODIES),
    limits=np.array(
        [
            [-2.7437, 2.7437],
            [-1.7837, 1.7837],
            [-2.9007, 2.9007],
            [-3.0421, -0.1518],
            [-2.8065, 2.8065],
            [0.5445, 4.5169],
            [-3.0159, 3.0159],
        ]
    ),
    home=_FRANKA_HOME,
    source=(
        "Franka Research 3: franka_description 0.4; data sheet. Joint limits: its"
        " fr3/joint_limits.yaml (joint 1: 2.7437 rad); the maker's later system limits are wider"
        " (2.9007), its suggested ranges for planners narrower (2.3476, before 2.3093)"
    ),
)

IIWA14 = Robot(
    name="iiwa14",
    chain=Chain(
        tuple(f"joint_{i}" for i in range(1, 8)),
        np.stack(
            [
                transform((0, 0, 0.1575)),
                transform((0, 0, 0.2025), (_QUARTER, 0, math.pi)),
                transform((0, 0.2045, 0), (_QUARTER, 0, math.pi)),
                transform((0, 0, 0.2155), (_QUARTER, 0, 0)),
                transform((0, 0.1845, 0), (-_QUARTER, math.pi, 0)),
                transform((0, 0, 0.2155), (_QUARTER, 0, 0)),
                transform((0, 0.081, 0), (-_QUARTER, math.pi, 0)),
                transform((0, 0, 0.045)),
            ]
        ),
        np.stack([_Z] * 7),
    ),
    mounts=(
        Mount(
            "upper_arm",
            1,
            np.array([0.0, 0.09274, 0.04607]),
            _unit(0, 0.9013, -0.4333),
            np.eye(3)[0],
            0.13,
            section=0.0705,
        ),
        Mount(
            "forearm",
            4,
            np.array([0.0, 0.0613, 0.0994]),
            _unit(0, 0.2929, 0.9561),
            np.eye(3)[0],
            0.074,
            section=0.044,
        ),
        Mount("tool", 7, _O, _Z, np.eye(3)[0], 0.0, section=0.053),
    ),
    reach=0.82,
    bodies=bodies_of(_IIWA_BODIES),
    limits=np.radians(_symmetric(170, 120, 170, 120, 170, 120, 175)),
    home=np.radians([0.0, 30.0, 0.0, -80.0, 0.0, 70.0, 0.0]),
    source="KUKA LBR iiwa 14 R820: iiwa_stack, iiwa_description; data sheet",
)
