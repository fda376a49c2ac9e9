"""Options that state how a robot is read from its description."""

import math
from dataclasses import dataclass, fields
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

    xacro_arg: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help="Argument of a xacro file: NAME=VALUE. Repeatable.",
        ),
    ] = ()

    def resolve(self) -> "UrdfOptions":
        """Return the options of the reader."""
        from ...formats.robots.urdf_options import UrdfOptions

        return UrdfOptions(
            self.base,
            self.tip,
            dict(_value(text) for text in self.hold),
            True,
            self.packages,
            {name: Path(value) for name, value in self._pairs("package", "NAME=FOLDER")},
            self.skip_missing_meshes,
            dict(self._pairs("xacro_arg", "NAME=VALUE")),
        )

    def _pairs(self, key: str, allowed: str) -> list[tuple[str, str]]:
        """Return the names and values of a repeatable option."""
        pairs = []
        for text in getattr(self, key):
            name, _, value = text.partition("=")
            if not (name and value):
                option = f"--{key.replace('_', '-')}"
                raise UserError(f"{option}: found {shown(text)}, allowed: {allowed}")
            pairs.append((name, value))
        return pairs

    def refuse_without(self, source: str | Path | None) -> None:
        """Raise a ``UserError`` if an option is given, but no description of a robot."""
        for given in fields(self):
            if source is None and getattr(self, given.name):
                option = f"--{given.name.replace('_', '-')}"
                raise UserError(
                    f"{option}: allowed only with a robot's URDF, MJCF or xacro file; a robot file"
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


AS_WRITTEN = ReadingOptions()
