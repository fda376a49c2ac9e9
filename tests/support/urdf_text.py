"""URDF texts for tests: of a chain as we have it, and drawn ones; and their kinematics by MuJoCo,
which is independent.
"""

import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from place_rings.coverage.robots.kinematics import Chain
from scipy.spatial.transform import Rotation

COMPILER = {
    "fusestatic": "false",
    "boundmass": "1e-3",
    "boundinertia": "1e-6",
    "autolimits": "true",
}


def words(values) -> str:
    return " ".join(f"{v:.17g}" for v in values)


def origin(T: np.ndarray) -> dict[str, str]:
    """The attributes of a URDF's origin; rpy without the library's own code."""
    R = T[:3, :3]
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if abs(math.cos(pitch)) > 1e-9:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    else:
        roll, yaw = math.atan2(-R[1, 2], R[1, 1]), 0.0
    return {"xyz": words(T[:3, 3]), "rpy": words((roll, pitch, yaw))}


def joint(
    robot: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    T: np.ndarray,
    axis=None,
    limits=None,
) -> None:
    e = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(e, "parent", link=parent)
    ET.SubElement(e, "child", link=child)
    ET.SubElement(e, "origin", origin(T))
    if axis is not None:
        ET.SubElement(e, "axis", xyz=words(axis))
    if limits is not None:
        ET.SubElement(
            e,
            "limit",
            lower=f"{limits[0]:.17g}",
            upper=f"{limits[1]:.17g}",
            effort="1",
            velocity="1",
        )


def chain_text(chain: Chain, name: str = "drawn") -> str:
    """A URDF of the links ``base``, ``link_0`` ... and ``tip``."""
    robot = ET.Element("robot", name=name)
    links = ["base", *(f"link_{i}" for i in range(len(chain))), "tip"]
    for link in links:
        ET.SubElement(robot, "link", name=link)
    for j in range(len(chain)):
        joint(
            robot,
            chain.joints[j],
            "prismatic" if chain.slides[j] else "revolute",
            links[j],
            links[j + 1],
            chain.origin[j],
            chain.axis[j],
            (-10, 10),
        )
    joint(robot, "to_tip", "fixed", links[-2], links[-1], chain.origin[-1])
    return ET.tostring(robot, encoding="unicode")


def drawn_chain(rng: np.random.Generator) -> Chain:
    """One to eight joints about or along any axes, some at the same place, a quarter of them
    prismatic.
    """
    n = int(rng.integers(1, 9))
    origin = np.tile(np.eye(4), (n + 1, 1, 1))
    origin[:, :3, :3] = Rotation.random(n + 1, rng).as_matrix()
    origin[:, :3, 3] = rng.uniform(-0.5, 0.5, (n + 1, 3)) * rng.integers(0, 2, n + 1)[:, None]
    origin[-1, 2, 3] += 0.1
    axis = rng.normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    slides = np.flatnonzero(rng.uniform(size=n) < 0.25).tolist()
    return Chain(tuple(f"j{i}" for i in range(n)), origin, axis, tuple(slides))


class Peer:
    """Poses of a URDF's links by MuJoCo, shapes left out."""

    def __init__(self, text: str) -> None:
        root = ET.fromstring(text)
        for link in root.findall("link"):
            for e in list(link):
                link.remove(e)
        ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", COMPILER)
        self.model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
        self.data = mujoco.MjData(self.model)

    def pose(self, angles: dict[str, float], link: str, base: str) -> np.ndarray:
        """T_base_link (4, 4) at joint angles, rad, by name."""
        for name, angle in angles.items():
            self.data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(self.model, self.data)
        return np.linalg.inv(self._body(base)) @ self._body(link)

    def _body(self, name: str) -> np.ndarray:
        T = np.eye(4)
        i = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
        if i > 0:  # the root is MuJoCo's world
            T[:3, :3], T[:3, 3] = self.data.xmat[i].reshape(3, 3), self.data.xpos[i]
        return T
