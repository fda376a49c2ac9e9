"""Fit a robot to the meshes of a URDF, with progress on stderr."""

from collections.abc import Sequence
from pathlib import Path

from ...coverage.choices import Surface
from ...formats.robots.description import read_description
from ...formats.robots.meshes import Meshes
from ...formats.robots.robot_fit import RobotFit, fit_robot
from ...formats.robots.urdf_chain import pick_chain
from ...reporting.terminal import Terminal


def import_urdf(
    path: Path,
    base: str | None = None,
    tip: str | None = None,
    packages: Sequence[Path] = (),
    capsules: int = 3,
    surface: Surface = "collision",
    name: str | None = None,
) -> RobotFit:
    """Return the robot of a URDF with bodies and mounts fitted to its meshes.

    Args:
        path: the URDF.
        base: link that does not move; by default the root.
        tip: link at the TCP; by default the end of the longest chain.
        packages: folders with the packages of ``package://`` addresses.
        capsules: largest number of capsules for a link.
        surface: meshes to which capsules are fitted.
        name: name of the robot; by default that in the URDF.

    Raises:
        UserError: if the URDF or a mesh is not usable.
    """
    urdf = read_description(path)
    picked = pick_chain(urdf, base, tip)
    log = Terminal(stderr=True)
    with log.status("fitting") as status:

        def tell(link: str) -> None:
            status.update(f"fitting capsules to {link}")

        fit = fit_robot(picked, Meshes(path, packages), name or urdf.name, capsules, surface, tell)
    for note in urdf.notes:
        log.print(note, highlight=False, soft_wrap=True, markup=False)
    if picked.left_out:
        names = ", ".join(picked.left_out)
        log.print(
            f"Ignored, because their joints are not on the chain: {names}",
            highlight=False,
            soft_wrap=True,
        )
    if not fit.links:
        log.print(
            "No link has a shape, so the robot has no bodies and only the tool carries a ring.",
            highlight=False,
        )
    return fit
