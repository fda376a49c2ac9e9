"""Reader of a robot's description: URDF or MJCF, by the root of the file."""

from pathlib import Path

from .mjcf import read_mjcf
from .urdf import LARGEST, read_urdf
from .urdf_model import Urdf
from .xml_text import bounded_bytes, plain_xml


def read_description(path: Path) -> Urdf:
    """Return the links and joints of a robot in a URDF or MJCF file.

    Raises:
        UserError: if it cannot be read or is not supported.
    """
    root = plain_xml(bounded_bytes(path, LARGEST), str(path))
    return read_mjcf(path, root) if root.tag == "mujoco" else read_urdf(path)
