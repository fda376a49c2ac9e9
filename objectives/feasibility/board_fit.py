"""How many sensors a ring of a scene can have: whose boards fit around it and, where rings have
bodies, clear its link, and which its electronics carry.
"""

import math

import numpy as np

from ...coverage.electronics.electronics import limit_text, most_on_ring
from ...coverage.rings.ring import Ring
from ...coverage.robots.ring_section import surrounded
from ...coverage.sensors.board_packing import inner_radius, most_boards, tilt_range
from ...coverage.sensors.boards import NOMINAL, Board
from ...coverage.sensors.sensor import Sensor
from ..scene import Scene

Tilts = tuple[float, float]


def board_of(scene: Scene, sensor: Sensor) -> Board | None:
    """Return the board to fit, nominal where the sensor's is unknown; None where rings have no
    bodies."""
    return (sensor.board or NOMINAL) if scene.real else None


def innermost(scene: Scene, link: str) -> float:
    """Return the minimum distance of a pocket from the axis of ``link``, m; 0 without bodies."""
    around = surrounded(scene.robot, link) if scene.real else 0.0
    return inner_radius(around, scene.printing)


def most_wired(scene: Scene, ring: Ring) -> int | None:
    """Return the maximum sensor count of a ring by its electronics; None without electrical data,
    and where rings have no bodies."""
    if not scene.real:
        return None
    return most_on_ring(scene.electronics, ring.sensor, ring.radius)


def unwired(scene: Scene, ring: Ring, count: int = 0) -> str:
    """Return a message on why a ring's electronics do not carry its sensors, or ``count``; empty if
    they do."""
    if not scene.real:
        return ""
    return limit_text(scene.electronics, ring.sensor, ring.radius, count or ring.count)


def fitting_tilts(scene: Scene, ring: Ring) -> Tilts | None:
    """Return the lowest and highest allowed tilt, rad, at which all boards of a ring fit around it.

    Returns None if there is no such tilt, or its electronics do not carry so many sensors.
    """
    wired = most_wired(scene, ring)
    if wired is not None and ring.count > wired:
        return None
    low, high = scene.limits_of(ring.link).tilt
    board = board_of(scene, ring.sensor)
    if board is None:
        return low, high
    inside = innermost(scene, ring.link)
    fitting = tilt_range(board, scene.printing, ring.radius, ring.count, inside)
    if fitting is None:
        return None
    low, high = max(low, fitting[0]), min(high, fitting[1])
    return (low, high) if low <= high else None


def most_sensors(scene: Scene, ring: Ring) -> float:
    """Return the maximum sensor count of a ring; infinity if no board has to fit."""
    board = board_of(scene, ring.sensor)
    if board is None:
        return math.inf
    inside = innermost(scene, ring.link)
    return float(most_boards(board, scene.printing, ring.radius, np.array([ring.tilt]), inside)[0])


def unfit(scene: Scene, ring: Ring) -> str | None:
    """Return a message on why a ring's boards do not fit around it; None if they do."""
    board, most = board_of(scene, ring.sensor), most_sensors(scene, ring)
    if board is None or ring.count <= most:
        return None
    size = f"boards of {1000 * board.width:.4g} × {1000 * board.height:.4g} mm"
    where = (
        f"on a ring of radius {1000 * ring.radius:.1f} mm tilted by {math.degrees(ring.tilt):.1f}°"
    )
    if most > 0:
        return f"{ring.count} {size} do not fit {where}: at most {most:.0f} do"
    clear = f"{1000 * innermost(scene, ring.link):.1f} mm from the axis"
    return f"{size} come nearer than {clear} {where}: none fits; use a larger radius or less tilt"
