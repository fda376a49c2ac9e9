"""How many boards a ring of a scene takes: as many as go around it and, where rings have bodies,
clear its link.
"""

import math

import numpy as np

from ...coverage.rings.ring import Ring
from ...coverage.robots.ring_section import surrounded
from ...coverage.sensors.board_packing import inner_radius, most_boards, tilt_range
from ...coverage.sensors.boards import Board
from ...coverage.sensors.sensor import Sensor
from ..scene import Scene

Tilts = tuple[float, float]


def board_of(scene: Scene, sensor: Sensor) -> Board | None:
    """The board that counts: none where the scene says that rings have no bodies."""
    return None if scene.rules.mount == "free" else sensor.board


def innermost(scene: Scene, link: str) -> float:
    """How near to the axis of ``link`` a pocket may come, m; 0 where rings have no bodies."""
    around = surrounded(scene.robot.mount(link), scene.robot.bodies) if scene.real else 0.0
    return inner_radius(around, scene.printing)


def fitting_tilts(scene: Scene, ring: Ring) -> Tilts | None:
    """The tilts, lowest and highest, rad, that the scene's limits allow and at which all boards of
    a ring go around it; None where there is none."""
    low, high = scene.limits_of(ring.link).tilt
    board = board_of(scene, ring.sensor)
    if board is None:
        return low, high
    inside = innermost(scene, ring.link)
    found = tilt_range(board, scene.printing, ring.radius, ring.count, inside)
    if found is None:
        return None
    low, high = max(low, found[0]), min(high, found[1])
    return (low, high) if low <= high else None


def most_sensors(scene: Scene, ring: Ring) -> float:
    """The largest count of a ring of that radius and tilt; infinity where no board counts."""
    board = board_of(scene, ring.sensor)
    if board is None:
        return math.inf
    inside = innermost(scene, ring.link)
    return float(most_boards(board, scene.printing, ring.radius, np.array([ring.tilt]), inside)[0])


def unfit(scene: Scene, ring: Ring) -> str | None:
    """Why a ring cannot be built, in words; None where its boards go around it."""
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
    return (
        f"{size} come nearer than {clear} {where}: none fits, it takes a larger radius or less tilt"
    )
