"""Surface of a robot's links from its URDF's meshes, shown in place of its bodies."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.definitions.errors import UserError, shown
from ..coverage.robots.kinematics import Chain, forward
from ..coverage.robots.robot import BASE, Robot
from ..formats.robots.description import read_description
from ..formats.robots.urdf_matching import chain_between
from ..formats.robots.urdf_options import UrdfOptions
from ..reporting.rendering.surface import Surface

_SAME = 0.005  # m, largest distance between joints of equal chains
_POSES = 8  # random poses at which chains are compared


@dataclass(frozen=True)
class Skin:
    """Triangles (T, 3, 3) m of a robot's links, each in a frame of its chain."""

    chain: Chain
    links: tuple[tuple[int, Float[np.ndarray, "_ 3 3"]], ...]

    def at(self, q: Float[np.ndarray, " J"]) -> Surface:
        """Return the surface at joint angles ``q`` (J,) rad, base frame."""
        frames, found = forward(self.chain, q), []
        for frame, triangles in self.links:
            T = np.eye(4) if frame == BASE else frames[frame]
            found.append((triangles @ T[:3, :3].T + T[:3, 3]).reshape(-1, 3))
        vertices = np.concatenate(found) if found else np.zeros((0, 3))
        return vertices, np.arange(len(vertices)).reshape(-1, 3)


def read_skin(path: Path, reading: UrdfOptions, robot: Robot) -> Skin:
    """Read the visual meshes of the URDF at ``path``.

    Args:
        path: URDF.
        reading: the folders of meshes; and the chain, unless the URDF has joints with the names of
            the robot's.
        robot: robot whose joints must equal those of the URDF.

    Raises:
        UserError: for an invalid URDF or mesh, or if the joints differ from those of ``robot``.
    """
    urdf = read_description(path)
    joints = robot.chain.joints
    named = all(name in urdf.joints for name in joints)
    picked = chain_between(urdf, joints[0], joints[-1], robot) if named else reading.pick(urdf)
    wanted = f"a URDF with the joints of robot {shown(robot.name)}"
    if len(picked.chain) != len(robot.chain):
        raise UserError(
            f"--urdf: found {len(picked.chain)} joints in {path}, allowed: {wanted},"
            f" {len(robot.chain)}"
        )
    chain, T_base = picked.chain, np.eye(4)
    if named:  # base and TCP are the robot's, which may begin and end elsewhere
        T_base = robot.chain.origin[0] @ np.linalg.inv(chain.origin[0])
        ends = robot.chain.origin[[0, -1]]
        chain = replace(chain, origin=np.stack([ends[0], *chain.origin[1:-1], ends[1]]))
    for q in (robot.rest, *np.random.default_rng(0).uniform(-1, 1, (_POSES, len(robot.chain)))):
        off = (forward(chain, q) - forward(robot.chain, q))[:, :3, 3]
        if (worst := float(np.abs(off).max())) > _SAME:
            raise UserError(
                f"--urdf: found joints of {path} off by up to {worst:.3g} m, allowed: {wanted}"
            )
    meshes = reading.meshes(urdf)
    links = ((carried.frame, meshes.surface(carried, "visual")) for carried in picked.carried)
    found = tuple(
        (frame, triangles @ T_base[:3, :3].T + T_base[:3, 3] if frame == BASE else triangles)
        for frame, triangles in links
        if len(triangles)
    )
    if not found:
        raise UserError(f"--urdf: found no shape in {path}, allowed: links with meshes or shapes")
    return Skin(chain, found)
