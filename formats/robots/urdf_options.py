"""How a robot is read from its URDF: ends of the chain, held joints, and folders of its meshes."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...coverage.choices import Surface
from .meshes import Meshes
from .mjcf import read_mjcf
from .robot_fit import RobotFit, fit_robot
from .urdf import LARGEST, read_urdf
from .urdf_chain import pick_chain
from .urdf_folding import Picked
from .urdf_model import Urdf
from .xml_text import bounded_bytes, plain_xml


def read_description(path: Path) -> Urdf:
    """Return the links and joints of a robot in a URDF or MJCF file.

    Raises:
        UserError: if it cannot be read or is not supported.
    """
    root = plain_xml(bounded_bytes(path, LARGEST), str(path))
    return read_mjcf(path, root) if root.tag == "mujoco" else read_urdf(path)


@dataclass(frozen=True)
class UrdfOptions:
    """Choices that a URDF leaves open."""

    base: str | None = None
    """Link that does not move; by default the root."""
    tip: str | None = None
    """Link at the TCP; by default the tip of the longest arm, before its gripper."""
    hold: Mapping[str, float] = field(default_factory=dict)
    """Values of joints by name that do not move, rad, or m for prismatic joints."""
    degrees: bool = False
    """Whether ``hold`` is in degrees instead of rad; metres stay metres."""
    packages: Sequence[str | Path] = ()
    """Folders that are packages of ``package://`` addresses, or hold packages."""
    package: Mapping[str, str | Path] = field(default_factory=dict)
    """Folders of packages by the packages' names."""
    skip_missing_meshes: bool = False
    """Whether to leave out meshes whose file does not exist; a note names each."""

    def pick(self, urdf: Urdf) -> Picked:
        """Return the chain of a URDF.

        Raises:
            UserError: if it has none, or several.
        """
        values = {}
        for name, value in self.hold.items():
            joint = urdf.joints.get(name)
            turns = self.degrees and (joint is None or not joint.slides)
            values[name] = math.radians(value) if turns else value
        return pick_chain(urdf, self.base, self.tip, values)

    def meshes(self, urdf: Urdf) -> Meshes:
        """Return the reader of a URDF's meshes.

        Raises:
            UserError: if a folder does not exist.
        """
        folders = tuple(map(Path, self.packages))
        named = {name: Path(folder) for name, folder in self.package.items()}
        return Meshes(urdf.path, folders, named, urdf.addresses, self.skip_missing_meshes)

    def fit(
        self,
        path: Path,
        name: str | None = None,
        capsules: int = 3,
        surface: Surface = "collision",
        tell: Callable[[str], None] | None = None,
    ) -> RobotFit:
        """Return the robot of a URDF with bodies and mounts fitted to its meshes.

        Args:
            path: the URDF.
            name: name of the robot; by default that in the URDF.
            capsules: largest number of capsules for a link.
            surface: meshes to which capsules are fitted.
            tell: receives each link's name before its fit.

        Raises:
            UserError: if the URDF or a mesh is not usable.
        """
        urdf = read_description(path)
        picked = self.pick(urdf)
        return fit_robot(picked, self.meshes(urdf), name or urdf.name, capsules, surface, tell)
