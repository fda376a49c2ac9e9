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
wrist (forearm); the FR3 has the Panda's bodies and mounts because it shares its housings. On the
iiwa they are the tube of link 2 above the shoulder, and the neck of link 5.
"""

import math

import numpy as np

from ...solids.capsules import Capsules
from ..kinematics import Chain, transform
from ..robot import BASE, Body, Mount, Robot

_QUARTER = math.pi / 2
_Z = np.eye(3)[2]
_O = np.zeros(3)

_Capsule = tuple[str, int, tuple[float, float, float], tuple[float, float, float], float]


def _unit(*v: float) -> np.ndarray:
    unit: np.ndarray = np.array(v) / np.linalg.norm(v)
    return unit


def _bodies(rows: tuple[_Capsule, ...]) -> tuple[Body, ...]:
    return tuple(
        Body(name, frame, Capsules(np.array(start), np.array(end), radius))
        for name, frame, start, end, radius in rows
    )


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
        section=0.062,
    ),
    Mount(
        "forearm",
        4,
        np.array([0.0, 0.0767, -0.1517]),
        _unit(0, 0.2158, 0.9764),
        np.eye(3)[0],
        0.089,
        section=0.037,
    ),
    Mount("tool", 7, _O, _Z, np.eye(3)[0], 0.0, section=0.091),
)
_FRANKA_HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 100.0, 45.0])


def _joints(prefix: str) -> tuple[str, ...]:
    return tuple(f"{prefix}joint{i}" for i in range(1, 8))


def _symmetric(*limits: float) -> np.ndarray:
    return np.stack([-np.array(limits), np.array(limits)], axis=1)


_PANDA_BODIES: tuple[_Capsule, ...] = (
    ("link0", BASE, (0, 0, 0.0503), (-0.0577, 0, 0.024), 0.1055),
    ("link1", 0, (0, -0.0534, 0.0011), (0, 0, -0.1395), 0.0763),
    ("link2", 1, (0, -0.1415, 0), (0, 0.0006, 0.0533), 0.0764),
    ("link3", 2, (0.0825, 0.0424, 0), (0.001, -0.0004, -0.0807), 0.0694),
    ("link4", 3, (0, 0, 0.0424), (-0.0812, 0.084, 0.0001), 0.0694),
    ("link5_0", 4, (0, 0.0542, -0.1756), (0, 0, -0.2367), 0.0596),
    ("link5_1", 4, (0, 0.095, -0.0763), (0, 0.0777, -0.1356), 0.0341),
    ("link5_2", 4, (0, 0.0843, -0.0122), (0, 0.0583, 0), 0.0643),
    ("link6", 5, (0.0222, 0.009, 0.0054), (0.088, 0.0091, 0), 0.0749),
    ("link7_0", 6, (-0.0049, -0.0049, 0.0741), (0.0153, 0.0153, 0.0749), 0.0495),
    ("link7_1", 6, (0.0318, 0.0625, 0.0821), (0.0629, 0.0318, 0.0821), 0.0228),
)
_IIWA_BODIES: tuple[_Capsule, ...] = (
    ("link_0", BASE, (0, 0, 0.0554), (-0.0376, -0.0016, 0.0669), 0.1335),
    ("link_1", 0, (0, -0.0306, 0.2035), (0, -0.0004, 0.0295), 0.091),
    ("link_2", 1, (0.0004, -0.0012, 0.0396), (0.0006, 0.1398, 0.0004), 0.0944),
    ("link_3", 2, (0, 0, 0.0396), (0, 0.0404, 0.2167), 0.079),
    ("link_4", 3, (0, -0.0012, 0.041), (0.0002, 0.145, 0.001), 0.0798),
    ("link_5_0", 4, (0.0003, 0.062, 0.1306), (0, 0.0645, 0.2155), 0.0518),
    ("link_5_1", 4, (0, 0.0241, 0.0587), (0, 0, 0.0248), 0.0726),
    ("link_6", 5, (0, -0.0157, -0.0004), (0, 0.021, 0), 0.0796),
    ("link_7", 6, (0, 0, 0.0065), (0, 0, 0.0065), 0.0525),
)

PANDA = Robot(
    name="panda",
    chain=Chain(_joints("panda_"), _FRANKA, np.stack([_Z] * 7)),
    mounts=_FRANKA_MOUNTS,
    reach=0.855,
    bodies=_bodies(_PANDA_BODIES),
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
    bodies=_bodies(_PANDA_BODIES),
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
            np.array([0.0, 0.0904, 0.0472]),
            _unit(0, 0.9013, -0.4333),
            np.eye(3)[0],
            0.133,
            section=0.073,
        ),
        Mount(
            "forearm",
            4,
            np.array([0.0, 0.0613, 0.0994]),
            _unit(0, 0.2929, 0.9561),
            np.eye(3)[0],
            0.078,
            section=0.046,
        ),
        Mount("tool", 7, _O, _Z, np.eye(3)[0], 0.0, section=0.053),
    ),
    reach=0.82,
    bodies=_bodies(_IIWA_BODIES),
    limits=np.radians(_symmetric(170, 120, 170, 120, 170, 120, 175)),
    home=np.radians([0.0, 30.0, 0.0, -80.0, 0.0, 70.0, 0.0]),
    source="KUKA LBR iiwa 14 R820: iiwa_stack, iiwa_description; data sheet",
)
