"""Readings of sensors as topics of ROS 2, and those of a twin along a motion."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from ...coverage.rings.ring import Group
from ...coverage.sensors.sensor import Sensor
from ...formats.export.mcap_log import Topic
from ...formats.export.placed import PlacedSetup
from ...formats.export.ros2_bag import POINTS, RANGE, RosBag
from ...formats.ring_status import Status
from ...formats.sensors.sensor_frames import zone_ways
from .building import TwinOptions, sensor_twin
from .zone_grid import stated_turn, zone_grid

_MM = 1000.0


def twin_topics(
    placed: PlacedSetup, bag: RosBag, stamps: Float[np.ndarray, " S"], q: Float[np.ndarray, "S J"]
) -> Iterator[Topic]:
    """Yield what the sensors of a twin report during a motion: for each sensor ``/tof_R_K`` (Range)
    or, with zones, ``/tof_R_K/zones`` (PointCloud2).

    Args:
        placed: the setup in its scene.
        bag: makes the messages.
        stamps: stamps, s.
        q: joint values then, rad or m; they change evenly between.

    Raises:
        UserError: if MuJoCo is not installed.
    """
    twin, whole = sensor_twin("", placed.setup, placed.scene, TwinOptions()), placed.whole
    frame, end = twin.reset(q[0]), float(stamps[-1] - stamps[0])
    before, now = np.full(len(twin.names), -np.inf), 0.0
    while True:
        for k in np.flatnonzero(frame.time > before).tolist():
            group = whole.groups[whole.ring_of_sensor[k]]
            measured = max(float(stamps[0] + frame.time[k]), 0.0)
            distance, status = frame.distance_mm[k] / _MM, frame.status[k]
            yield (
                float(stamps[0] + now),
                *reading(bag, measured, twin.names[k], group, distance, status),
            )
        if now >= end:
            return
        before, step = frame.time, min(twin.dt, end - now)
        now = end if step < twin.dt else now + step
        frame = twin.step([np.interp(stamps[0] + now, stamps, joint) for joint in q.T], step)


def reading(
    bag: RosBag,
    stamp: float,
    name: str,
    group: Group,
    distance: Float[np.ndarray, " z"],
    status: Integer[np.ndarray, " z"],
) -> tuple[str, str, Any]:
    """Return topic, kind and message of a sensor's reading.

    Args:
        bag: makes the message.
        stamp: when it was measured, s.
        name: the sensor's frame.
        group: its ring, or the single sensor.
        distance: distance of each zone in the order of a frame, m.
        status: status of each.
    """
    sensor = group.sensor
    if (grid := zone_grid(sensor)) == (1, 1):
        limits = 0.0, max(sensor.range_m, sensor.farthest)
        read = range_of(float(distance[0]), int(status[0]))
        return f"/{name}", RANGE, bag.range(stamp, name, beam_angle(sensor), limits, read)
    shape = stated_turn(group).arrives(np.zeros(grid)).shape
    state, far = (np.reshape(a[: math.prod(grid)], shape) for a in (status, distance))
    cloud = bag.points(stamp, name, zone_points(far, state, group), state)
    return f"/{name}/zones", POINTS, cloud


def range_of(distance: float, status: int) -> float:
    """Return a reading, m, as a Range states it: a weak or failed one is nan."""
    if status == Status.VALID:
        return distance
    return math.inf if status == Status.NO_TARGET else math.nan


def beam_angle(sensor: Sensor) -> float:
    """Return the whole angle of a beam, rad."""
    return 2 * min(sensor.half_angle, math.pi)


def zone_points(
    distance: Float[np.ndarray, "r c"], status: Integer[np.ndarray, "r c"], group: Group
) -> Float[np.ndarray, "r c 3"]:
    """Return the targets of a sensor's zones, in the order of arrival, in the frame that looks
    along x with its up along z, m; nan where there is none."""
    turn = stated_turn(group)
    way = np.roll(zone_ways(group.sensor, *turn.meant(distance).shape), 1, axis=-1)
    arrived = np.stack([turn.arrives(way[..., i]) for i in range(3)], axis=-1)
    points: np.ndarray = np.where(status == Status.VALID, distance, np.nan)[..., None] * arrived
    return points
