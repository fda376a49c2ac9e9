"""XML that is written: trees, numbers and transforms as attributes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import rpy_of


def words(values: Iterable[float]) -> str:
    """Numbers as an attribute lists them."""
    return " ".join(f"{round(float(v), 12) + 0.0:.12g}" for v in values)


def origin(T: Float[np.ndarray, "4 4"]) -> dict[str, str]:
    """A transform as the attributes of a URDF's origin."""
    return {"xyz": words(T[:3, 3]), "rpy": words(rpy_of(T[:3, :3]))}


def document(root: ET.Element) -> bytes:
    """The tree as a file, indented."""
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
