"""Lids of a printed ring: the solid of one, the room that the ring leaves for them, their screws,
and a lid as it is printed. Millimetres, frames of ``PrintPlan``."""

import math

import numpy as np
from jaxtyping import Float
from manifold3d import CrossSection, Manifold

from ...coverage.sensors.lids import SCREW_HEAD, Lid
from .blocks import wedge
from .mounted_boards import beyond_plugs
from .primitives import SMALL, box, union
from .print_plan import MM, PrintPlan

_OVER = 0.2  # overlap of a cut beyond the surface
_SLIT = 1.5  # width of a slit between a boss and the rim below which it is filled
_ROUND = 32  # facets of a round window
_FLIP = np.diag([1.0, -1.0, -1.0])  # from the frame of a lens to a lid that lies on its front


def lid_solid(plan: PrintPlan) -> Manifold:
    """Return a lid in the frame of its lens; the empty solid without lids."""
    lid = plan.pocket.lid
    if lid is None:
        return Manifold()
    shell = _prism(lid.outline, lid.back, lid.front)
    shell -= _prism(lid.extent(), lid.back - 1e-3, lid.under)
    bosses = union([_boss(lid, x, y) for x, y in lid.spots])
    whole = shell + (bosses ^ _prism(lid.outline, lid.back, lid.front))
    return whole - _screw_holes(lid) - _window(plan, lid) - _plug_openings(plan, lid)


def _prism(outline: tuple[float, float, float, float], back: float, front: float) -> Manifold:
    """Return the box over an outline between two distances ahead of the lens, all m."""
    x0, x1, y0, y1 = (MM * v for v in outline)
    return box((x0, y0, MM * back), (x1, y1, MM * front))


def _boss(lid: Lid, x: float, y: float) -> Manifold:
    """Return the boss around the screw at (x, y) m, from the board to the plate.

    It is extended to a rim beside it, so that no narrow slit remains.
    """
    low, high, r = -MM * lid.board.lens_height, MM * lid.under + _OVER, MM * lid.boss
    x0, x1, y0, y1 = lid.extent()
    shifts = [(MM * v for v in (x0 - x, x1 - x)), (MM * v for v in (y0 - y, y1 - y))]
    across, up = ([0.0, *(v for v in some if abs(v) < r + _SLIT)] for some in shifts)
    disc = CrossSection.circle(r, 2 * SMALL)
    discs = [disc.translate((MM * x + u, MM * y + v)) for u in across for v in up]
    return CrossSection.batch_hull(discs).extrude(high - low).translate((0.0, 0.0, low))


def _screw_holes(lid: Lid) -> Manifold:
    """Return the holes for the screws."""
    low, high = MM * lid.back - 1.0, MM * lid.front + 1.0
    hole = Manifold.cylinder(high - low, MM * lid.hole, -1.0, SMALL)
    return union([hole.translate((MM * x, MM * y, low)) for x, y in lid.spots])


def _window(plan: PrintPlan, lid: Lid) -> Manifold:
    """Return the opening for the beam: round or square as the beam is, it widens with it."""
    sensor, rings = plan.ring.sensor, []
    for ahead in (lid.under - _OVER / MM, lid.front + _OVER / MM):
        if sensor.square:
            wide, high = (MM * v for v in lid.window(sensor, ahead))
            outline = np.array([(u * wide, v * high) for u in (-1, 1) for v in (-1, 1)])
        else:
            half, _ = lid.window(sensor, ahead)
            flat, _ = lid.window(sensor, 0.0)
            r, corner = MM * (half - flat) / math.cos(math.pi / _ROUND), MM * flat
            turns = 2 * math.pi / _ROUND * (np.arange(_ROUND) + 0.5)
            disc = r * np.stack([np.cos(turns), np.sin(turns)], axis=1)
            corners = corner * np.array([(u, v) for u in (-1, 1) for v in (-1, 1)])
            outline = (corners[:, None] + disc).reshape(-1, 2)
        rings.append(np.column_stack([outline, np.full(len(outline), MM * ahead)]))
    return Manifold.hull_points(np.concatenate(rings))


def _plug_openings(plan: PrintPlan, lid: Lid) -> Manifold:
    """Return the openings in the rim for plugs, open towards the board, so that a lid can be put on
    over cables that are plugged in."""
    ends, clear = (MM * lid.back - 1.0, MM * lid.under), MM * lid.clearance
    return beyond_plugs(plan, ends, clear, clear + MM * lid.thick + 1.0)


def lid_rooms(plan: PrintPlan) -> Manifold:
    """Return the room that a ring leaves for its lids and their screws; the empty solid without
    lids."""
    lid = plan.pocket.lid
    if lid is None:
        return Manifold()
    half, clear = lid.half + lid.clearance, lid.clearance
    outline = (-half, half, lid.low - clear, lid.high + clear)
    room = _prism(outline, lid.back - clear / 2, plan.front / MM)
    each = (room.transform(plan.frame(k)) for k in range(len(plan.angles)))
    return union([wedge(plan, k, one) for k, one in enumerate(each)])


def mounted_lids(plan: PrintPlan) -> list[Manifold]:
    """Return the lids of a mounted ring, one for each board; none without lids."""
    if plan.pocket.lid is None:
        return []
    lid = lid_solid(plan)
    return [lid.transform(plan.frame(k)) for k in range(len(plan.angles))]


def screw_heads(plan: PrintPlan) -> list[Manifold]:
    """Return the heads of the screws on each lid; none without lids."""
    lid = plan.pocket.lid
    if lid is None:
        return []
    head = Manifold.cylinder(MM * SCREW_HEAD, MM * lid.board.hole, -1.0, 2 * SMALL)
    some = union([head.translate((MM * x, MM * y, MM * lid.front)) for x, y in lid.spots])
    return [some.transform(plan.frame(k)) for k in range(len(plan.angles))]


def flat_lid(plan: PrintPlan) -> Manifold:
    """Return a lid as it is printed: it lies on its front, so that nothing overhangs."""
    return lid_solid(plan).rotate((180.0, 0.0, 0.0))


def lid_frames(plan: PrintPlan) -> list[Float[np.ndarray, "4 4"]]:
    """Return T_print_lid (4, 4), mm, of each lid, from ``flat_lid`` to its place on the ring."""
    some = []
    for k in range(len(plan.angles)):
        T = np.eye(4)
        T[:3] = plan.frame(k)
        T[:3, :3] @= _FLIP
        some.append(T)
    return some
