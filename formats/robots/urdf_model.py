"""Links and joints of a robot as a URDF states them; files of MuJoCo are read as these, too."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.choices import Surface
from ...coverage.robots.kinematics import transform

MOST_LINKS = 2000
_MOVING = ("revolute", "continuous", "prismatic", "planar", "floating")
JOINT_KINDS = (*_MOVING, "fixed")


@dataclass(frozen=True)
class UrdfShape:
    """A shape of a link."""

    kind: str
    """One of box, sphere, ellipsoid, cylinder, capsule and mesh."""
    T_link_shape: Float[np.ndarray, "4 4"]
    """Pose of the shape."""
    size: tuple[float, ...]
    """Edges of a box, radii, or radius and length along z, m; scale of a mesh."""
    file: str = ""
    """Name of a mesh file, as written."""


@dataclass(frozen=True)
class UrdfLink:
    """A link."""

    name: str
    """Name of the link."""
    collision: tuple[UrdfShape, ...] = ()
    """Shapes for collision."""
    visual: tuple[UrdfShape, ...] = ()
    """Shapes for display."""

    def shapes(self, which: Surface) -> tuple[UrdfShape, ...]:
        """Return the shapes of one kind."""
        return self.collision if which == "collision" else self.visual


@dataclass(frozen=True)
class Joint:
    """A joint from ``parent`` to ``child``."""

    name: str
    """Name of the joint."""
    kind: str
    """Type of the joint."""
    parent: str
    """Name of the parent link."""
    child: str
    """Name of the child link."""
    T_parent_joint: Float[np.ndarray, "4 4"]
    """Pose at angle 0."""
    axis: Float[np.ndarray, " 3"]
    """Unit vector of the axis."""
    limits: tuple[float, float]
    """Limits, rad (or m)."""
    mimic: str = ""
    """Name of the joint that it mimics, if any."""
    multiplier: float = 1.0
    """Value of a mimic joint per unit of the other joint's value."""
    offset: float = 0.0
    """Value of a mimic joint where the other's is 0, rad or m."""

    @property
    def moves(self) -> bool:
        """Whether the joint moves."""
        return self.kind != "fixed"

    @property
    def slides(self) -> bool:
        """Whether its value is a length."""
        return self.kind == "prismatic"

    @property
    def default(self) -> float:
        """The value nearest to 0 within the limits, rad or m."""
        return float(np.clip(0.0, *self.limits))

    def T_parent_child(self, value: float) -> Float[np.ndarray, "4 4"]:
        """Return the pose of the child link at a joint value, rad or m.

        A planar or a floating joint stays at its origin.
        """
        moved = np.eye(4)
        if self.kind == "prismatic":
            moved = transform(value * self.axis)
        if self.kind in ("revolute", "continuous"):
            moved = rotation(self.axis, value)
        T: np.ndarray = self.T_parent_joint @ moved
        return T

    def shown(self, value: float) -> str:
        """Return a value as ``--hold`` takes it: in metres for a prismatic joint, else in
        degrees."""
        return f"{value if self.slides else math.degrees(value):.6g}"


@dataclass(frozen=True)
class Urdf:
    """All links and joints of a file, by name."""

    path: Path
    """The file."""
    name: str
    """Name of the robot."""
    links: dict[str, UrdfLink]
    """Links by name."""
    joints: dict[str, Joint]
    """Joints by name."""
    notes: tuple[str, ...] = ()
    """What the reader dropped or took in another way than written, a sentence each."""
    expanded: ET.Element | None = field(default=None, repr=False, compare=False)
    """Root of the URDF that the file makes, if it is a xacro file."""

    @property
    def addresses(self) -> tuple[str, ...]:
        """The names of all mesh files."""
        shapes = (s for link in self.links.values() for s in (*link.collision, *link.visual))
        return tuple(dict.fromkeys(shape.file for shape in shapes if shape.file))


def rotation(axis: Float[np.ndarray, " 3"], angle: float) -> Float[np.ndarray, "4 4"]:
    """Return the rotation (4, 4) about a unit ``axis`` (3,) by ``angle``, rad."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix()
    return T
