"""MJCF texts for tests: trees that use each way to state a pose, a joint and a shape; and their
bodies by MuJoCo.
"""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from .urdf_text import words

SEQUENCES = ("xyz", "XYZ", "zyx", "ZYX", "xYz", "zxz")


def orientation(rng: np.random.Generator, degrees: bool) -> dict[str, str]:
    """An orientation in one of MJCF's ways."""
    kind = rng.choice(["quat", "axisangle", "xyaxes", "zaxis", "euler", ""])
    turn = 180 / np.pi if degrees else 1.0
    match kind:
        case "quat":
            return {"quat": words(rng.normal(size=4))}
        case "axisangle":
            return {"axisangle": words([*rng.normal(size=3), turn * rng.uniform(-3, 3)])}
        case "xyaxes":
            return {"xyaxes": words(Rotation.random(random_state=rng).as_matrix().T[:2].ravel())}
        case "zaxis":
            return {"zaxis": words(rng.normal(size=3))}
        case "euler":
            return {"euler": words(turn * rng.uniform(-3, 3, 3))}
    return {}


def pose(rng: np.random.Generator, degrees: bool) -> dict[str, str]:
    return {"pos": words(rng.uniform(-0.5, 0.5, 3)), **orientation(rng, degrees)}


def geom(rng: np.random.Generator, degrees: bool, meshes: tuple[str, ...]) -> dict[str, str]:
    """A shape of any kind, some between two points."""
    kind = rng.choice(
        ["sphere", "capsule", "cylinder", "box", "ellipsoid", *["mesh"] * len(meshes)]
    )
    if kind == "mesh":
        return {"type": "mesh", "mesh": str(rng.choice(meshes)), **pose(rng, degrees)}
    size = rng.uniform(0.02, 0.1, {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3))
    if kind != "sphere" and rng.uniform() < 0.4:
        across = size[:1] if kind in ("capsule", "cylinder") else size[:2]
        return {"type": kind, "size": words(across), "fromto": words(rng.uniform(-0.2, 0.2, 6))}
    return {"type": kind, "size": words(size), **pose(rng, degrees)}


def drawn_mjcf(rng: np.random.Generator, meshes: tuple[str, ...] = ()) -> ET.Element:
    """A chain of one to six bodies with up to two joints each, some in frames, with shapes, a
    branch here and there, and defaults by class.
    """
    degrees = bool(rng.integers(2))
    root = ET.Element("mujoco", model="drawn")
    angle = {} if degrees and rng.integers(2) else {"angle": "degree" if degrees else "radian"}
    massive = {"boundmass": "0.1", "boundinertia": "0.01"}
    ET.SubElement(root, "compiler", angle | massive, eulerseq=str(rng.choice(SEQUENCES)))
    outer = ET.SubElement(root, "default")
    ET.SubElement(outer, "joint", axis="0 1 0", armature="0.1")
    ET.SubElement(outer, "geom", contype="1")
    inner = ET.SubElement(outer, "default", {"class": "slide"})
    ET.SubElement(inner, "joint", type="slide", axis="1 0.5 0", range="-1 1")
    ET.SubElement(inner, "geom", euler="0 0 0.5", group="3")
    at, joints = ET.SubElement(root, "worldbody"), 0
    ET.SubElement(at, "geom", type="plane", size="1 1 0.1")
    for b in range(int(rng.integers(1, 7))):
        if rng.uniform() < 0.3:
            at = ET.SubElement(at, "frame", pose(rng, degrees))
        at = ET.SubElement(at, "body", pose(rng, degrees), name=f"b{b}")
        if rng.uniform() < 0.3:
            at.set("childclass", "slide")
        for _ in range(int(rng.choice([0, 1, 1, 1, 2])) if b else 1):
            keys = {"name": f"j{joints}"}
            if rng.uniform() < 0.7:
                keys["axis"] = words(rng.normal(size=3))
            if rng.uniform() < 0.4:
                keys["pos"] = words(rng.uniform(-0.2, 0.2, 3))
            if rng.uniform() < 0.4:
                keys["type"] = str(rng.choice(["hinge", "slide"]))
            if rng.uniform() < 0.4:
                keys["ref"] = words([rng.uniform(-1, 1)])
            if rng.uniform() < 0.4:
                keys["range"] = words(np.sort(rng.uniform(-2, 2, 2)))
            ET.SubElement(at, "joint", keys)
            joints += 1
        for _ in range(int(rng.integers(0, 3))):
            ET.SubElement(at, "geom", geom(rng, degrees, meshes))
        ET.SubElement(at, "geom", type="sphere", size="0.01")  # so that no body is without mass
        if rng.uniform() < 0.3:
            branch = ET.SubElement(at, "body", pose(rng, degrees), name=f"branch{b}")
            ET.SubElement(branch, "geom", geom(rng, degrees, meshes))
    return root


class MujocoBodies:
    """Poses of the bodies of a model by MuJoCo."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.data = model, mujoco.MjData(model)

    def move(self, values: dict[str, float]) -> None:
        """Set joints by name, rad or m; the others stay at their reference."""
        mujoco.mj_resetData(self.model, self.data)
        for name, value in values.items():
            self.data.joint(name).qpos[0] = value
        mujoco.mj_kinematics(self.model, self.data)

    def body(self, name: str) -> np.ndarray:
        """T_world_body (4, 4)."""
        T = np.eye(4)
        found = self.data.body(name)
        T[:3, :3], T[:3, 3] = found.xmat.reshape(3, 3), found.xpos
        return T

    def geom(self, i: int) -> np.ndarray:
        """T_world_geom (4, 4)."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.data.geom_xmat[i].reshape(3, 3), self.data.geom_xpos[i]
        return T
