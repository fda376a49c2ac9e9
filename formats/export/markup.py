"""XML output: trees, and numbers and transforms as attributes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import rpy_of
from ...coverage.solids.capsules import Capsules

_SHORT = 1e-5  # m, length of a capsule below which other programs may refuse it


def words(values: Iterable[float]) -> str:
    """Return numbers in the form of an XML attribute."""
    return " ".join(f"{round(float(v), 12) + 0.0:.12g}" for v in values)


def origin(T: Float[np.ndarray, "4 4"]) -> dict[str, str]:
    """Return a transform as the attributes of a URDF origin."""
    return {"xyz": words(T[:3, 3]), "rpy": words(rpy_of(T[:3, :3]))}


def add_inertial(
    link: ET.Element,
    mass: float = 0.0,
    centre: Float[np.ndarray, " 3"] | None = None,
    inertia: Float[np.ndarray, "3 3"] | None = None,
) -> None:
    """State the mass of a URDF's link, by default that it has none: programs such as PyBullet give
    1 kg and an inertia of 1 kg m² to a link that states nothing.

    Args:
        link: the link.
        mass: kg.
        centre: centre of mass in the link's frame, m; default: its origin.
        inertia: about the centre of mass, kg m²; default: 0.
    """
    about = np.zeros((3, 3)) if inertia is None else inertia
    part = ET.SubElement(link, "inertial")
    ET.SubElement(part, "origin", xyz=words(np.zeros(3) if centre is None else centre))
    ET.SubElement(part, "mass", value=words([mass]))
    moments = {
        f"i{'xyz'[i]}{'xyz'[j]}": words([about[i, j]]) for i in range(3) for j in range(i, 3)
    }
    ET.SubElement(part, "inertia", moments)


def ball_of(capsule: Capsules) -> tuple[Float[np.ndarray, " 3"], float] | None:
    """Return centre and radius, m, of the sphere that stands for a capsule of almost no length and
    contains it; None for any other capsule."""
    start, end = np.asarray(capsule.start), np.asarray(capsule.end)
    length = float(np.linalg.norm(end - start))
    return None if length >= _SHORT else ((start + end) / 2, float(capsule.radius) + length / 2)


def document(root: ET.Element) -> bytes:
    """Return the tree as an indented file."""
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def turn_to(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Return a rotation whose z axis is the unit vector ``axis``."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def capsule_shape(capsule: Capsules) -> tuple[Float[np.ndarray, "4 4"], float, float]:
    """Return a capsule as a frame (4, 4) m at its middle with z along its axis, the length of its
    axis, m, which is 0 for a sphere, and its radius, m."""
    start, end, T = np.asarray(capsule.start), np.asarray(capsule.end), np.eye(4)
    if (ball := ball_of(capsule)) is not None:
        T[:3, 3], radius = ball
        return T, 0.0, radius
    length = float(np.linalg.norm(end - start))
    T[:3, :3], T[:3, 3] = turn_to((end - start) / length), (start + end) / 2
    return T, length, float(capsule.radius)
