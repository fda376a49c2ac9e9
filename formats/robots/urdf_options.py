"""How a robot is read from its URDF: ends of the chain, held joints, and folders of its meshes."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from ...coverage.choices import Surface
from ...coverage.definitions.errors import UserError
from .descriptions import XACRO, find_description, is_description
from .meshes import Meshes
from .mjcf import read_mjcf
from .packages import Packages
from .robot_fit import RobotFit, fit_robot
from .urdf import LARGEST, read_urdf
from .urdf_chain import pick_chain
from .urdf_folding import Picked
from .urdf_model import Urdf
from .xacro_files import expand_xacro
from .xml_text import bounded_bytes, plain_xml


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
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    """Values of a xacro file's arguments by name."""

    def located(self, source: str | Path) -> tuple[Path, Self]:
        """Return the file of a robot's description, which a name may stand for, and the options
        that read it.

        Raises:
            UserError: if a name is unknown, or its files are not on this machine.
        """
        if not is_description(str(source)):
            return Path(source), self
        found = find_description(str(source))
        return found.path, replace(
            self,
            packages=(*self.packages, *found.packages),
            package={**found.named, **self.package},
            xacro_args={**found.arguments, **self.xacro_args},
        )

    def read(self, path: Path) -> Urdf:
        """Return the links and joints of a robot in a URDF, MJCF or xacro file.

        Raises:
            UserError: if it cannot be read or is not supported.
        """
        if path.suffix.lower() == XACRO:
            packages = Packages(path, tuple(map(Path, self.packages)), self._named)
            root = expand_xacro(path, self.xacro_args, packages)
            return replace(read_urdf(path, root), expanded=root)
        if self.xacro_args:
            raise UserError(f"--xacro-arg: {path}: allowed only with a xacro file (.xacro)")
        root = plain_xml(bounded_bytes(path, LARGEST), str(path))
        return read_mjcf(path, root) if root.tag == "mujoco" else read_urdf(path, root)

    @property
    def _named(self) -> dict[str, Path]:
        return {name: Path(folder) for name, folder in self.package.items()}

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
        return Meshes(urdf.path, folders, self._named, urdf.addresses, self.skip_missing_meshes)

    def fit(
        self,
        source: str | Path,
        name: str | None = None,
        capsules: int = 3,
        surface: Surface = "collision",
        tell: Callable[[str], None] | None = None,
    ) -> RobotFit:
        """Return the robot of a URDF with bodies and mounts fitted to its meshes.

        Args:
            source: the URDF, MJCF or xacro file, or a name of robot_descriptions.
            name: name of the robot; by default that in the URDF.
            capsules: largest number of capsules for a link.
            surface: meshes to which capsules are fitted.
            tell: receives each link's name before its fit.

        Raises:
            UserError: if the URDF or a mesh is not usable.
        """
        path, options = self.located(source)
        urdf = options.read(path)
        picked, meshes = options.pick(urdf), options.meshes(urdf)
        return fit_robot(picked, meshes, name or urdf.name, capsules, surface, tell)
