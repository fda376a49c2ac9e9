"""How a robot is read from its URDF, in the arguments of the API."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # reading meshes takes a while to load
    from .formats.robots.urdf_options import UrdfOptions


def urdf_options(
    base: str | None = None,
    tip: str | None = None,
    hold: Mapping[str, float] | None = None,
    packages: Sequence[str | Path] = (),
    package: Mapping[str, str | Path] | None = None,
    skip_missing_meshes: bool = False,
) -> "UrdfOptions":
    """Return how a URDF is read, from the arguments of ``load``."""
    from .formats.robots.urdf_options import UrdfOptions

    return UrdfOptions(
        base,
        tip,
        dict(hold or {}),
        packages=tuple(Path(folder) for folder in packages),
        package={name: Path(folder) for name, folder in (package or {}).items()},
        skip_missing_meshes=skip_missing_meshes,
    )
