"""MCAP: a run of the robot through the poses of a scene as a ROS 2 bag, for Foxglove, rerun, RViz
and ``ros2 bag play``."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.robot import BASE
from ..optional_dependencies import require
from ..sensors.sensor_frames import looking_along
from .glb_animation import keys, turn_of
from .placed import TCP_LINK, PlacedSetup

RUN = "run"  # folder of the bag
_RATE = 20.0  # messages per second
_MOST = 20_000  # messages of a topic
_START = 1.0  # s, of the first message: a stamp of 0 means the latest transform in ROS


def mcap(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``run/run.mcap`` and ``run/metadata.yaml``: ``/joint_states`` and ``/tf`` along the
    scene's poses, and ``/tf_static`` with all sensors, which look along x.

    Raises:
        UserError: if rosbags is missing, or the user's URDF lacks the robot's chain.
    """
    require("bags", "--to mcap", "rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    chain, store = placed.scene.robot.chain, get_typestore(Stores.ROS2_HUMBLE)
    stamps, q = _samples(placed)
    parents = [placed.carrier(BASE), *placed.links]
    turns = [turn_of(chain, j, q[:, j]) for j in range(len(chain))]
    base = np.linalg.inv(placed.T_base_root)
    turns[0] = _from_root(base, *turns[0])
    make = _Messages(store)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / RUN
        with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            topics = {
                topic: bag.add_connection(
                    topic, kind, typestore=store, offered_qos_profiles=_qos(topic == "/tf_static")
                )
                for topic, kind in _TOPICS.items()
            }

            def write(topic: str, stamp: float, message: Any) -> None:
                data = store.serialize_cdr(message, _TOPICS[topic])
                bag.write(topics[topic], round(1e9 * stamp), data)

            write("/tf_static", stamps[0], make.transforms(stamps[0], _fixed(placed)))
            for k, stamp in enumerate(stamps):
                write("/joint_states", stamp, make.joints(stamp, _names(placed), q[k]))
                moved = [
                    (parents[j], parents[j + 1], place[k], turned[k])
                    for j, (place, turned) in enumerate(turns)
                ]
                write("/tf", stamp, make.transforms(stamp, moved))
        return {f"{RUN}/{file.name}": file.read_bytes() for file in sorted(path.iterdir())}


_TOPICS = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/joint_states": "sensor_msgs/msg/JointState",
}
_Transform = tuple[str, str, Float[np.ndarray, " 3"], Float[np.ndarray, " 4"]]


def _names(placed: PlacedSetup) -> tuple[str, ...]:
    """Return the joints' names in ``robot.urdf``."""
    chain = placed.scene.robot.chain
    return placed.joint_names if placed.urdf is None else chain.joints


def _samples(placed: PlacedSetup) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S J"]]:
    """Return stamps (S,) s and joint values (S, J), evenly in time along the poses."""
    times, q = keys(placed.scene.robot.chain, placed.scene.poses)
    count = int(min(times[-1] * _RATE + 1, _MOST))
    at = np.linspace(0, times[-1], max(count, 1))
    return _START + at, np.stack([np.interp(at, times, joint) for joint in q.T], axis=1)


def _from_root(
    T_root_base: Float[np.ndarray, "4 4"],
    place: Float[np.ndarray, "S 3"],
    turned: Float[np.ndarray, "S 4"],
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 4"]]:
    """Return the first joint's frames in the link that holds it, not in the scene's base."""
    R = Rotation.from_matrix(T_root_base[:3, :3])
    return R.apply(place) + T_root_base[:3, 3], (R * Rotation.from_quat(turned)).as_quat()


def _fixed(placed: PlacedSetup) -> list[_Transform]:
    """Return the transforms to the TCP, where it has a name, and to the sensors."""
    made = [(placed.links[-1], TCP_LINK, placed.scene.robot.chain.origin[-1])]
    made = made if placed.urdf is None else []
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        made.append((placed.carrier(joint), s.name, looking_along(T, "x")))
    return [(a, b, T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat()) for a, b, T in made]


def _qos(kept: bool) -> list[Any]:
    """Return the quality of service of a topic; ``kept`` for late subscribers or not."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(2147483647, 4294967295)
    durability = QosDurability.TRANSIENT_LOCAL if kept else QosDurability.VOLATILE
    return [
        Qos(
            QosHistory.KEEP_LAST,
            1 if kept else 100,
            QosReliability.RELIABLE,
            durability,
            forever,
            forever,
            QosLiveliness.AUTOMATIC,
            forever,
            False,
        )
    ]


class _Messages:
    """Maker of ROS 2 messages."""

    def __init__(self, store: Any) -> None:
        self.types = store.types

    def _make(self, name: str, *values: Any) -> Any:
        return self.types[name](*values)

    def _header(self, stamp: float, frame: str = "") -> Any:
        whole = round(1e9 * stamp)
        time = self._make("builtin_interfaces/msg/Time", whole // 10**9, whole % 10**9)
        return self._make("std_msgs/msg/Header", time, frame)

    def joints(self, stamp: float, names: Sequence[str], q: Float[np.ndarray, " J"]) -> Any:
        """Return a JointState."""
        none = np.zeros(0)
        header = self._header(stamp)
        return self._make("sensor_msgs/msg/JointState", header, list(names), q, none, none)

    def transforms(self, stamp: float, some: Sequence[_Transform]) -> Any:
        """Return a TFMessage."""
        made = []
        for parent, child, place, turned in some:
            xyz = self._make("geometry_msgs/msg/Vector3", *map(float, place))
            xyzw = self._make("geometry_msgs/msg/Quaternion", *map(float, turned))
            move = self._make("geometry_msgs/msg/Transform", xyz, xyzw)
            kind, header = "geometry_msgs/msg/TransformStamped", self._header(stamp, parent)
            made.append(self._make(kind, header, child, move))
        return self._make("tf2_msgs/msg/TFMessage", made)
