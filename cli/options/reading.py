"""Options that state how a robot is read from its URDF."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError, shown
from .common import READING

if TYPE_CHECKING:  # imported when the options are resolved
    from ...formats.robots.urdf_options import UrdfOptions


@Parameter(name="*", group=READING)
@dataclass(frozen=True)
class ReadingOptions:
    """The chain of a URDF, its held joints, and the folders of its meshes."""

    base: Annotated[
        str | None, Parameter(help="Link that does not move. Default: the root of the URDF.")
    ] = None
    tip: Annotated[
        str | None,
        Parameter(
            help=(
                "Link at the tool centre point. Default: the tip of the longest arm, before its"
                " gripper; tool0, tcp or flange if there is one."
            )
        ),
    ] = None
    hold: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help=(
                "Joint that does not move: NAME=VALUE, in degrees, or in metres for a prismatic"
                " joint. Joints outside the chain stand at 0, or at the limit nearest to it."
                " Repeatable."
            ),
        ),
    ] = ()
    packages: Annotated[
        tuple[Path, ...],
        Parameter(
            negative=(),
            help=(
                "Folder in which to find the package:// meshes of the URDF: a package, or a folder"
                " with packages, by their folders' names or their package.xml. Besides it, meshes"
                " may lie in the URDF's own folder and package. Repeatable."
            ),
        ),
    ] = ()
    package: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help="Folder of a package of another name: NAME=FOLDER. Repeatable.",
        ),
    ] = ()
    skip_missing_meshes: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Leave out meshes whose file does not exist, and name each of them: the robot's"
                " body is then incomplete."
            ),
        ),
    ] = False

    def resolve(self) -> "UrdfOptions":
        """Return the options of the reader."""
        from ...formats.robots.urdf_options import UrdfOptions

        return UrdfOptions(
            self.base,
            self.tip,
            dict(_value(text) for text in self.hold),
            True,
            self.packages,
            {name: Path(folder) for name, folder in map(_folder, self.package)},
            self.skip_missing_meshes,
        )

    def refuse_without(self, urdf: Path | None) -> None:
        """Raise a ``UserError`` if an option is given, but no URDF."""
        for key in ("base", "tip", "hold", "packages", "package", "skip_missing_meshes"):
            if urdf is None and getattr(self, key):
                option = f"--{key.replace('_', '-')}"
                raise UserError(
                    f"{option}: allowed only with the URDF of a robot (.urdf); a robot file"
                    " (.toml) states how it was read"
                )


def _value(text: str) -> tuple[str, float]:
    name, equals, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (name and equals) or not math.isfinite(number):
        raise UserError(f"--hold: found {shown(text)}, allowed: NAME=VALUE, such as lift_joint=0.2")
    return name, number


def _folder(text: str) -> tuple[str, str]:
    name, equals, folder = text.partition("=")
    if not (name and equals and folder):
        raise UserError(f"--package: found {shown(text)}, allowed: NAME=FOLDER")
    return name, folder


AS_WRITTEN = ReadingOptions()
