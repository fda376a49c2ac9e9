"""The robot in a URDF, fitted to its meshes."""

from collections.abc import Sequence
from pathlib import Path

from ...coverage.choices import Surface
from ...formats.robots.meshes import Meshes
from ...formats.robots.robot_fit import RobotFit, fit_robot
from ...formats.robots.urdf import read_urdf
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
    """The robot in a URDF with bodies and mounts fitted to its meshes, told on stderr; UserError
    for one that is bad.
    """
    urdf = read_urdf(path)
    picked = pick_chain(urdf, base, tip)
    log = Terminal(stderr=True)
    with log.status("fitting") as status:

        def tell(link: str) -> None:
            status.update(f"fitting capsules to {link}")

        fit = fit_robot(picked, Meshes(path, packages), name or urdf.name, capsules, surface, tell)
    if picked.left_out:
        names = ", ".join(picked.left_out)
        log.print(
            f"left out, as joints beside the chain move them: {names}",
            highlight=False,
            soft_wrap=True,
        )
    if not fit.links:
        log.print("no link has a shape: no bodies, and no mount but the tool", highlight=False)
    return fit
