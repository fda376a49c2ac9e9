"""XML output: trees, and numbers and transforms as attributes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import rpy_of


def words(values: Iterable[float]) -> str:
    """Return numbers in the form of an XML attribute."""
    return " ".join(f"{round(float(v), 12) + 0.0:.12g}" for v in values)


def origin(T: Float[np.ndarray, "4 4"]) -> dict[str, str]:
    """Return a transform as the attributes of a URDF origin."""
    return {"xyz": words(T[:3, 3]), "rpy": words(rpy_of(T[:3, :3]))}


def document(root: ET.Element) -> bytes:
    """Return the tree as an indented file."""
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
