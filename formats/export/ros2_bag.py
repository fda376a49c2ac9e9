"""Writer of ROS 2 bags (MCAP), by rosbags without ROS, and the messages in them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from jaxtyping import Float, Integer

from ..optional_dependencies import require

Transform = tuple[str, str, Float[np.ndarray, " 3"], Float[np.ndarray, " 4"]]
"""Parent frame, child frame, translation in m, and unit quaternion x y z w."""

JOINTS, TRANSFORMS, RANGE, POINTS, TEXT, LOG = (
    "sensor_msgs/msg/JointState",
    "tf2_msgs/msg/TFMessage",
    "sensor_msgs/msg/Range",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/String",
    "rcl_interfaces/msg/Log",
)
STATIC = "/tf_static"
_INFRARED = 1
_UINT8, _FLOAT32 = 2, 7  # codes of a PointField's type
_FIELDS = (("x", _FLOAT32), ("y", _FLOAT32), ("z", _FLOAT32), ("ring_status", _UINT8))
_POINT = np.dtype([*((axis, "<f4") for axis in "xyz"), ("ring_status", "u1"), ("", "V3")])


def require_rosbags(option: str) -> None:
    """Raise UserError that names ``option`` if rosbags is missing."""
    require("bags", option, "rosbags")


class RosBag:
    """A bag under construction: a new folder with one MCAP file and ``metadata.yaml``.

    Args:
        folder: the folder, which must not exist.
    """

    def __init__(self, folder: Path) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self._store: Any = get_typestore(Stores.ROS2_HUMBLE)
        self._bag: Any = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._topics = dict[str, Any]()

    def __enter__(self) -> Self:
        self._bag.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bag.close()

    def write(self, topic: str, kind: str, received: float, message: Any) -> None:
        """Store a message of type ``kind`` that was received at ``received`` s."""
        if topic not in self._topics:
            qos = _qos(kept=topic == STATIC)
            self._topics[topic] = self._bag.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=qos
            )
        data = self._store.serialize_cdr(message, kind)
        self._bag.write(self._topics[topic], round(1e9 * received), data)

    def _make(self, kind: str, *values: Any) -> Any:
        return self._store.types[kind](*values)

    def _time(self, stamp: float) -> Any:
        whole = round(1e9 * stamp)
        return self._make("builtin_interfaces/msg/Time", whole // 10**9, whole % 10**9)

    def _header(self, stamp: float, frame: str = "") -> Any:
        return self._make("std_msgs/msg/Header", self._time(stamp), frame)

    def joints(self, stamp: float, names: Sequence[str], q: Float[np.ndarray, " J"]) -> Any:
        """Return a JointState."""
        none = np.zeros(0)
        return self._make(JOINTS, self._header(stamp), list(names), q, none, none)

    def transforms(self, stamp: float, some: Sequence[Transform]) -> Any:
        """Return a TFMessage."""
        made = []
        for parent, child, place, turned in some:
            xyz = self._make("geometry_msgs/msg/Vector3", *map(float, place))
            xyzw = self._make("geometry_msgs/msg/Quaternion", *map(float, turned))
            move = self._make("geometry_msgs/msg/Transform", xyz, xyzw)
            kind, header = "geometry_msgs/msg/TransformStamped", self._header(stamp, parent)
            made.append(self._make(kind, header, child, move))
        return self._make(TRANSFORMS, made)

    def range(
        self, stamp: float, frame: str, angle: float, limits: tuple[float, float], read: float
    ) -> Any:
        """Return a Range.

        Args:
            stamp: when it was measured, s.
            frame: the sensor's frame.
            angle: whole angle of the beam, rad.
            limits: least and largest distance that the sensor states, m.
            read: distance, m; infinite without a target, nan without a valid reading (REP 117).
        """
        return self._make(RANGE, self._header(stamp, frame), _INFRARED, angle, *limits, read)

    def points(
        self,
        stamp: float,
        frame: str,
        xyz: Float[np.ndarray, "r c 3"],
        status: Integer[np.ndarray, "r c"],
    ) -> Any:
        """Return a PointCloud2 of r rows of c points, m; nan where there is none.

        The field ``ring_status`` of a point holds its ``status``, 0 to 255.
        """
        fields = [
            self._make("sensor_msgs/msg/PointField", name, 4 * i, kind, 1)
            for i, (name, kind) in enumerate(_FIELDS)
        ]
        rows, columns = xyz.shape[:2]
        points = np.zeros((rows, columns), _POINT)
        for i, axis in enumerate("xyz"):
            points[axis] = xyz[..., i]
        points["ring_status"] = status
        data = np.frombuffer(points.tobytes(), np.uint8)
        shape, steps = (rows, columns), (_POINT.itemsize, _POINT.itemsize * columns)
        header, dense = self._header(stamp, frame), bool(np.isfinite(xyz).all())
        return self._make(POINTS, header, *shape, fields, False, *steps, data, dense)

    def text(self, text: str) -> Any:
        """Return a String."""
        return self._make(TEXT, text)

    def log(self, stamp: float, level: int, name: str, text: str) -> Any:
        """Return a Log of the severity ``level`` (20 information, 30 warning, 40 error)."""
        return self._make(LOG, self._time(stamp), level, name, text, "", "", 0)


def bag_files(folder: Path) -> Mapping[str, bytes]:
    """Return the files of a bag by their names."""
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


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
