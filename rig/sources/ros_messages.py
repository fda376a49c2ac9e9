"""Decode the ROS 2 messages of a rig.

The message definitions are those that rosbags holds, so that no definition in a file is ever
compiled.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Integer

from ...formats.export.ros2_bag import JOINTS, POINTS, RANGE, TEXT
from ...formats.ring_frame import MOST_ZONES as MOST_OF_FRAME
from ...formats.ring_status import known_status
from ..rings.protocol import Status
from .messages import FARTHEST, JointMessage, Message, RangeMessage, StepMessage, ranged

MOST_ZONES = 4096  # of one sensor
_SQUARE = {16: (4, 4), 64: (8, 8)}  # zones of clouds of one row
_UINT8, _FLOAT32 = 2, 7  # codes of a PointField's type
_STATUS = "ring_status"  # field of a point, of the zone's ``Status``


class BadMessageError(ValueError):
    """A message is damaged; the text says what was found and what is wanted."""


@cache
def _types(release: str) -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores[f"ROS2_{release}"])


def _decoded(data: bytes, kind: str, release: str = "HUMBLE") -> Any:
    """Return a message in CDR, as a release of ROS 2 defines it; raise BadMessageError if it is
    none."""
    from rosbags.serde import SerdeError

    try:
        return _types(release).deserialize_cdr(data, kind)
    except (SerdeError, ValueError, IndexError, MemoryError, OverflowError) as error:
        raise BadMessageError(
            f"found {len(data)} bytes that are no such message, wanted: {kind} in CDR"
            + ("; decompress the bag" if data[:4] == b"\x28\xb5\x2f\xfd" else "")
        ) from error


def _stamp(header: Any) -> float:
    """Return a header's time stamp, s; nan if it is 0."""
    seconds = header.stamp.sec + 1e-9 * header.stamp.nanosec
    return seconds if seconds > 0 else math.nan


def _joint_state(topic: str, time: float, data: bytes) -> JointMessage:
    message = _decoded(data, JOINTS)
    names, position = tuple(message.name), np.array(message.position, float)
    if len(names) != len(position):
        raise BadMessageError(
            f"found {len(names)} names and {len(position)} positions, wanted: as many of each"
        )
    return JointMessage(topic, time, _stamp(message.header), names, position)


def _range(topic: str, time: float, data: bytes) -> RangeMessage:
    try:
        message = _decoded(data, RANGE)
    except BadMessageError:
        message = _decoded(data, RANGE, "IRON")  # with a variance
    low = message.min_range if math.isfinite(message.min_range) else 0.0
    high = message.max_range if math.isfinite(message.max_range) else 0.0
    read = ranged(message.range, low, high)
    return RangeMessage(topic, message.header.frame_id, time, _stamp(message.header), *read)


def _zones(topic: str, time: float, data: bytes) -> RangeMessage:
    """Return a sensor's zones, and the nearest: the first return in its field of view."""
    message = _decoded(data, POINTS)
    count = message.height * message.width
    if count > MOST_ZONES:
        raise BadMessageError(
            f"found a cloud of {count} points, wanted: at most {MOST_ZONES}, the zones of one"
            " sensor"
        )
    fields = _columns(message)
    distance = np.linalg.norm([fields[axis].astype(float) for axis in "xyz"], axis=0)
    some = np.isfinite(distance) & (distance > 0) & (distance <= FARTHEST)
    status = np.where(some, Status.VALID, Status.NO_TARGET)
    if (stated := fields.get(_STATUS)) is not None:
        known = known_status(stated)
        unread = np.isin(known, (Status.WEAK, Status.FAILED))
        some, status = some & ~unread, np.where(unread, known, status)
    seen = distance[some]
    read = (float(seen.min()), Status.VALID) if len(seen) else (math.nan, _without_target(status))
    shape = _SQUARE.get(count) if message.height == 1 else (message.height, message.width)
    zones: tuple[np.ndarray | None, np.ndarray | None] = (None, None)
    if shape is not None and 1 < count <= MOST_OF_FRAME:
        zones = (np.where(some, distance, np.nan).reshape(shape), status.reshape(shape))
    return RangeMessage(topic, message.header.frame_id, time, _stamp(message.header), *read, *zones)


def _without_target(status: Integer[np.ndarray, " n"]) -> Status:
    """Return the status of a sensor of whose zones none has a valid target."""
    if Status.WEAK in status:
        return Status.WEAK
    failed = len(status) and (status == Status.FAILED).all()
    return Status.FAILED if failed else Status.NO_TARGET


def _columns(message: Any) -> dict[str, np.ndarray]:
    """Return x, y, z (n,) m of the points of a cloud, and ``ring_status`` where `check --bag`
    wrote it."""
    fields = {field.name: field for field in message.fields}
    if not {"x", "y", "z"} <= set(fields):
        raise BadMessageError(
            f"found the fields {', '.join(sorted(fields)) or 'none'}, wanted: x, y and z"
        )
    if any(fields[axis].datatype != _FLOAT32 for axis in "xyz"):
        raise BadMessageError("found coordinates of another type, wanted: FLOAT32")
    types = dict.fromkeys("xyz", ">f4" if message.is_bigendian else "<f4")
    if _STATUS in fields and fields[_STATUS].datatype == _UINT8:
        types[_STATUS] = "u1"
    if message.height * message.width == 0:
        return dict.fromkeys(types, np.zeros(0))
    step, row, data = message.point_step, message.row_step, message.data
    last = max(fields[name].offset + np.dtype(kind).itemsize for name, kind in types.items())
    if last > step or message.width * step > row or message.height * row > len(data):
        raise BadMessageError(
            f"found {len(data)} bytes, wanted: {message.height} rows of {row} bytes with"
            f" {message.width} points of {step} bytes"
        )
    shape, strides = (message.height, message.width), (row, step)
    return {
        name: np.ndarray(shape, kind, data, fields[name].offset, strides).ravel()
        for name, kind in types.items()
    }


def _text(topic: str, time: float, data: bytes) -> StepMessage:
    return StepMessage(topic, time, str(_decoded(data, TEXT).data))


DECODERS: dict[str, Callable[[str, float, bytes], Message]] = {
    JOINTS: _joint_state,
    RANGE: _range,
    POINTS: _zones,
    TEXT: _text,
}
