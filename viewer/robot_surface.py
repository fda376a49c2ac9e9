"""Surface of a robot's links from its URDF's meshes, shown in place of its bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.robots.kinematics import Chain, forward
from ..coverage.robots.robot import BASE, Robot
from ..formats.errors import UserError, shown
from ..formats.robots.meshes import Meshes
from ..formats.robots.urdf import read_urdf
from ..formats.robots.urdf_chain import pick_chain
from ..reporting.rendering.surface import Surface

_SAME = 0.005  # m, largest distance between joints of equal chains
_POSES = 8  # random poses at which chains are compared


@dataclass(frozen=True)
class Skin:
    """Triangles (T, 3, 3) m of a robot's links, each in a frame of its chain."""

    chain: Chain
    links: tuple[tuple[int, Float[np.ndarray, "T 3 3"]], ...]

    def at(self, q: Float[np.ndarray, " J"]) -> Surface:
        """Return the surface at joint angles ``q`` (J,) rad, base frame."""
        frames, found = forward(self.chain, q), []
        for frame, triangles in self.links:
            T = np.eye(4) if frame == BASE else frames[frame]
            found.append((triangles @ T[:3, :3].T + T[:3, 3]).reshape(-1, 3))
        vertices = np.concatenate(found) if found else np.zeros((0, 3))
        return vertices, np.arange(len(vertices)).reshape(-1, 3)


def read_skin(path: Path, packages: Sequence[Path], robot: Robot) -> Skin:
    """Read the visual meshes of the URDF at ``path``.

    Args:
        path: URDF.
        packages: folders in which the meshes' packages are searched.
        robot: robot whose joints must equal those of the URDF.

    Raises:
        UserError: for an invalid URDF or mesh, or if the joints differ from those of ``robot``.
    """
    picked = pick_chain(read_urdf(path))
    wanted = f"a URDF with the joints of robot {shown(robot.name)}"
    if len(picked.chain) != len(robot.chain):
        raise UserError(
            f"--urdf: found {len(picked.chain)} joints in {path}, allowed: {wanted},"
            f" {len(robot.chain)}"
        )
    for q in (robot.rest, *np.random.default_rng(0).uniform(-1, 1, (_POSES, len(robot.chain)))):
        off = (forward(picked.chain, q) - forward(robot.chain, q))[:, :3, 3]
        if (worst := float(np.abs(off).max())) > _SAME:
            raise UserError(
                f"--urdf: found joints of {path} off by up to {worst:.3g} m, allowed: {wanted}"
            )
    meshes = Meshes(path, packages)
    links = ((carried.frame, meshes.surface(carried, "visual")) for carried in picked.carried)
    found = tuple((frame, triangles) for frame, triangles in links if len(triangles))
    if not found:
        raise UserError(f"--urdf: found no shape in {path}, allowed: links with meshes or shapes")
    return Skin(picked.chain, found)
