"""Transforms between the frames of a robot and its sensors over time, as ROS 2 has them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.robot import BASE
from ..sensors.sensor_frames import looking_along
from .glb_animation import turn_of
from .placed import TCP_LINK, PlacedSetup
from .ros2_bag import Transform


def moved_frames(placed: PlacedSetup, q: Float[np.ndarray, "S J"]) -> list[list[Transform]]:
    """Return the transforms of all links that the joints move, at S joint vectors, rad or m.

    Raises:
        UserError: if the user's URDF lacks the robot's chain.
    """
    chain = placed.scene.robot.chain
    parents = [placed.carrier(BASE), *placed.links]
    turns = [turn_of(chain, j, q[:, j]) for j in range(len(chain))]
    turns[0] = _from_root(np.linalg.inv(placed.T_base_root), *turns[0])
    return [
        [
            (parents[j], parents[j + 1], place[k], turned[k])
            for j, (place, turned) in enumerate(turns)
        ]
        for k in range(len(q))
    ]


def fixed_frames(placed: PlacedSetup) -> list[Transform]:
    """Return the transforms to the TCP, where it has a name, and to the sensors, which look along
    x."""
    made = [(placed.links[-1], TCP_LINK, placed.scene.robot.chain.origin[-1])]
    made = made if placed.urdf is None else []
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        made.append((placed.carrier(joint), s.name, looking_along(T, "x")))
    return [(a, b, T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat()) for a, b, T in made]


def joint_names(placed: PlacedSetup) -> Sequence[str]:
    """Return the joints' names in ``robot.urdf``."""
    chain = placed.scene.robot.chain
    return placed.joint_names if placed.urdf is None else chain.joints


def _from_root(
    T_root_base: Float[np.ndarray, "4 4"],
    place: Float[np.ndarray, "S 3"],
    turned: Float[np.ndarray, "S 4"],
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 4"]]:
    """Return the first joint's frames in the link that holds it, not in the scene's base."""
    R = Rotation.from_matrix(T_root_base[:3, :3])
    return R.apply(place) + T_root_base[:3, 3], (R * Rotation.from_quat(turned)).as_quat()
