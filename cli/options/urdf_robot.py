"""Fit a robot to the meshes of a URDF, with progress and notes on stderr."""

from pathlib import Path

from ...coverage.choices import Surface
from ...formats.robots.robot_fit import RobotFit
from ...formats.robots.urdf_options import UrdfOptions
from ...reporting.terminal import Terminal

_READING = UrdfOptions()


def import_urdf(
    source: str | Path,
    reading: UrdfOptions = _READING,
    capsules: int = 3,
    surface: Surface = "collision",
    name: str | None = None,
) -> RobotFit:
    """Return the robot of a description with bodies and mounts fitted to its meshes.

    Args:
        source: its file, or its name in robot_descriptions.
        reading: the chain, held joints and folders of meshes.
        capsules: largest number of capsules for a link.
        surface: meshes to which capsules are fitted.
        name: name of the robot; by default that in the URDF.

    Raises:
        UserError: if the URDF or a mesh is not usable.
    """
    log = Terminal(stderr=True)
    with log.status("fitting") as status:

        def tell(link: str) -> None:
            status.update(f"fitting capsules to {link}")

        fit = reading.fit(source, name, capsules, surface, tell)
    notes = list(fit.notes)
    if not fit.links:
        notes.append(
            "No link has a shape, so the robot has no bodies and only the tool carries a ring."
        )
    log.lines(*notes)
    return fit
