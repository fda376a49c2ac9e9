"""MCAP: a run of the robot through the poses of a scene as a ROS 2 bag, for Foxglove, rerun, RViz
and ``ros2 bag play``."""

import heapq
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.robot import BASE
from ..sensors.sensor_frames import looking_along
from .glb_animation import keys, turn_of
from .placed import TCP_LINK, PlacedSetup
from .ros2_bag import JOINTS, STATIC, TRANSFORMS, RosBag, Transform, bag_files, require_rosbags

RUN = "run"  # folder of the bag
_RATE = 20.0  # messages per second
_MOST = 20_000  # messages of a topic
_START = 1.0  # s, of the first message: a stamp of 0 means the latest transform in ROS


Topic = tuple[float, str, str, Any]
"""A message: when it was received, s, its topic, its type, and itself."""
Readings = Callable[
    [PlacedSetup, RosBag, Float[np.ndarray, " S"], Float[np.ndarray, "S J"]], Iterable[Topic]
]
"""Makes the messages of sensors along joint values (S, J), rad or m, at stamps (S,) s."""


def mcap(placed: PlacedSetup, readings: Readings | None = None) -> dict[str, bytes]:
    """Return ``run/run.mcap`` and ``run/metadata.yaml``: ``/joint_states`` and ``/tf`` along the
    scene's poses, ``/tf_static`` with all sensors, which look along x, and ``readings``.

    Raises:
        UserError: if rosbags is missing, or the user's URDF lacks the robot's chain.
    """
    require_rosbags("--to mcap")
    stamps, q = _samples(placed)
    moved, names = moved_frames(placed, q), joint_names(placed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / RUN
        with RosBag(path) as bag:
            fixed = bag.transforms(stamps[0], fixed_frames(placed))
            bag.write(STATIC, TRANSFORMS, stamps[0], fixed)
            topics = [] if readings is None else [readings(placed, bag, stamps, q)]
            for stamp, topic, kind, message in heapq.merge(
                _motion(bag, stamps, q, names, moved), *topics, key=lambda message: message[0]
            ):
                bag.write(topic, kind, stamp, message)
        return {f"{RUN}/{name}": data for name, data in bag_files(path).items()}


def _motion(
    bag: RosBag,
    stamps: Float[np.ndarray, " S"],
    q: Float[np.ndarray, "S J"],
    names: Sequence[str],
    moved: Sequence[list[Transform]],
) -> Iterator[Topic]:
    for k, stamp in enumerate(stamps.tolist()):
        yield stamp, "/joint_states", JOINTS, bag.joints(stamp, names, q[k])
        yield stamp, "/tf", TRANSFORMS, bag.transforms(stamp, moved[k])


def _samples(placed: PlacedSetup) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S J"]]:
    """Return stamps (S,) s and joint values (S, J), evenly in time along the poses."""
    times, q = keys(placed.scene.robot.chain, placed.scene.poses)
    count = int(min(times[-1] * _RATE + 1, _MOST))
    at = np.linspace(0, times[-1], max(count, 1))
    return _START + at, np.stack([np.interp(at, times, joint) for joint in q.T], axis=1)


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
    """Return the transforms to the TCP, where it has a name, to the pendant's Base, where the cell
    is stated in it, and to the sensors, which look along x."""
    made = [(placed.links[-1], TCP_LINK, placed.scene.robot.chain.origin[-1])]
    made = made if placed.urdf is None else []
    made += [] if placed.pendant_base is None else [placed.pendant_base]
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
