"""Boards of a printed ring with the room of their plugs, and the beams of their sensors.
Millimetres, print frame."""

import math

import numpy as np
from manifold3d import Manifold

from ...coverage.sensors.boards import PACKAGE, PLUG_HALF
from .primitives import SMALL, box, union
from .print_plan import MM, PrintPlan


def on_board(plan: PrintPlan, x: float, y: float) -> tuple[float, float]:
    """Convert a point of the board, m from its middle, to the frame of its lens, mm."""
    lens = plan.pocket.board.lens
    return MM * (x - lens[0]), MM * (y - lens[1])


def board(plan: PrintPlan, k: int) -> Manifold:
    """Return the board of sensor ``k`` with its sensor's package, whose front is at the lens."""
    b = plan.pocket.board
    x, y = on_board(plan, 0.0, 0.0)
    w, h, front = MM * b.width / 2, MM * b.height / 2, -MM * b.lens_height
    plate = box((x - w, y - h, -plan.seat), (x + w, y + h, front))
    for at in b.holes:
        u, v = on_board(plan, *at)
        plate -= Manifold.cylinder(plan.front + plan.seat, MM * b.hole / 2, -1.0, SMALL).translate(
            (u, v, -plan.seat - 1.0)
        )
    if front < 0:
        wide, high = (MM * side / 2 for side in PACKAGE)
        plate += box((-wide, -high, front - 0.1), (wide, high, 0.0))
    return plate.transform(plan.frame(k))


def plugs(plan: PrintPlan, k: int) -> Manifold:
    """Return the room of the plugs of a board and of the bend of their wires."""
    front = -MM * plan.pocket.board.lens_height
    ends = (front, front + MM * plan.pocket.board.plug_height)
    return beyond_plugs(plan, ends).transform(plan.frame(k))


def beyond_plugs(
    plan: PrintPlan, ends: tuple[float, float], aside: float = 0.0, least: float = 0.0
) -> Manifold:
    """Return the room of a board's plugs beyond its edges in the frame of its lens.

    Args:
        plan: the ring.
        ends: rear and front of the room, ahead of the lens.
        aside: distance by which it is wider on either side.
        least: least length beyond the edges.
    """
    b = plan.pocket.board
    x, y = on_board(plan, 0.0, 0.0)
    w, h = MM * b.width / 2, MM * b.height / 2
    side, up = (max(MM * v, least) if v else 0.0 for v in b.plugs)
    across, upright = (min(MM * PLUG_HALF, v) + aside for v in (w, h))
    rooms = []
    for sign in (-1.0, 1.0):
        if up:
            low, high = sorted((y + sign * h, y + sign * (h + up)))
            rooms.append(box((x - across, low, ends[0]), (x + across, high, ends[1])))
        if side:
            low, high = sorted((x + sign * w, x + sign * (w + side)))
            rooms.append(box((low, y - upright, ends[0]), (high, y + upright, ends[1])))
    return union(rooms)


def beam(plan: PrintPlan, k: int) -> Manifold:
    """Return the beam of sensor ``k``, as far as the ring could intersect it."""
    sensor, length = plan.ring.sensor, min(MM * plan.ring.sensor.range_m, 4 * plan.radius)
    wide, high = (length * math.tan(a) for a in (sensor.half_angle, sensor.half_angle_up))
    if not sensor.square:
        near = MM * sensor.aperture
        solid = Manifold.cylinder(length, near, near + wide, 64)
    else:
        corners = [(u * wide, v * high, length) for u in (-1, 1) for v in (-1, 1)]
        solid = Manifold.hull_points(np.array([(0.0, 0.0, 0.0), *corners]))
    return solid.transform(plan.frame(k))
