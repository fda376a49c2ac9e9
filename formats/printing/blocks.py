"""Blocks of a printed ring that carry the boards: pockets, posts for screws, ribs, and the cable
groove. Millimetres, print frame."""

import math

import numpy as np
from manifold3d import CrossSection, Manifold

from .mounted_boards import on_board
from .primitives import SMALL, box, tube, union
from .print_plan import MM, PrintPlan

_THREAD = 8.0  # largest depth of a screw in the ring
_BORED = 0.4  # radius of a screw's thread, relative to the diameter of the hole in the board
_LEFT = 1.5  # material around a screw's hole, and between it and the bore
_OVER = 0.2  # overlap of a cut beyond the surface
_LIGHT = 12.0  # least length and height of an opening in the sides of a block


def wedge(plan: PrintPlan, k: int, solid: Manifold, inset: float = 0.0) -> Manifold:
    """Return the part of a solid that is nearer to sensor ``k`` than to its neighbours, by at least
    ``inset``."""
    n = len(plan.angles)
    if n < 2:
        return solid
    for sign in (-1.0, 1.0):
        edge = plan.angles[k] + sign * math.pi / n
        solid = solid.trim_by_plane((sign * math.sin(edge), -sign * math.cos(edge), 0.0), inset)
    return solid


def _upright(plan: PrintPlan, k: int, solid: Manifold) -> Manifold:
    """Rotate a solid from the x axis to sensor ``k``."""
    return solid.rotate((0.0, 0.0, math.degrees(plan.angles[k])))


def block(plan: PrintPlan, k: int) -> Manifold:
    """Return the block that carries the board of sensor ``k``: from the middle outwards to the
    front of its pocket."""
    size = (plan.outermost, plan.half, plan.top)
    solid = _upright(plan, k, box((0.0, -plan.half, plan.low), size))
    look = plan.frame(k)[:, 2]
    front = float(look @ plan.frame(k)[:, 3]) - plan.rim
    return wedge(plan, k, solid.trim_by_plane(tuple(-look), -front))


def window(plan: PrintPlan, k: int) -> Manifold:
    """Return the opening of a block between collar and pocket where they are far apart."""
    end, half = plan.groove[0] - plan.wall, MM * plan.pocket.half - plan.wall
    if half <= 0 or end - plan.collar < plan.wall:
        return Manifold()
    solid = _upright(plan, k, box((0.0, -half, plan.low - 1), (end, half, plan.top + 1)))
    return wedge(plan, k, solid, (plan.wall + MM * plan.printing.gap) / 2) - tube(
        plan.collar, plan.low - 2, plan.top + 2
    )


def side_openings(plan: PrintPlan, k: int) -> Manifold:
    """Return the openings in the two walls that a window leaves of a long block, so that ribs
    remain; their roofs of 45 degrees need no support."""
    start, end = plan.collar + plan.wall, plan.groove[0] - 2 * plan.wall
    low, high = plan.low + plan.wall, plan.top - plan.wall
    count = math.ceil((end - start + plan.wall) / (high - low + plan.wall))
    if window(plan, k).is_empty() or end - start < _LIGHT or high - low < _LIGHT:
        return Manifold()
    wide = (end - start + plan.wall) / count - plan.wall
    eaves = high - min(wide / 2, high - low)
    openings = []
    for i in range(count):
        a = start + i * (wide + plan.wall)
        house = [
            (a, low),
            (a + wide, low),
            (a + wide, eaves),
            (a + wide / 2, eaves + wide / 2),
            (a, eaves),
        ]
        solid = CrossSection.hull_points(np.array(house)).extrude(2 * plan.half + 2)
        openings.append(solid.rotate((90.0, 0.0, 0.0)).translate((0.0, plan.half + 1, 0.0)))
    # openings of neighbours that touch overlap, so that no film remains between them
    return wedge(plan, k, _upright(plan, k, union(openings)), -_OVER)


def pocket(plan: PrintPlan, k: int) -> Manifold:
    """Return the space of a board, open in front and above, and of the components behind it."""
    p, board, clear = plan.pocket, plan.pocket.board, MM * plan.printing.clearance
    x, half = -MM * board.lens[0], MM * board.width / 2
    seat, low, high = -plan.seat, MM * p.low, MM * p.high
    high += _OVER
    room = box((x - half - clear, low, seat), (x + half + clear, high, plan.front))
    ledge = 1.0
    relief = box(
        (x - half + ledge, low + ledge, -MM * p.deep), (x + half - ledge, high, seat + 0.1)
    )
    return (room + relief).transform(plan.frame(k))


def thread(plan: PrintPlan, y: float) -> float:
    """Return the possible depth of a screw behind a board at height ``y`` up the board, mm from the
    lens."""
    c, s = math.cos(plan.tilt), math.sin(plan.tilt)
    inwards = plan.radius - plan.seat * c - y * s - plan.inner + plan.wall - _LEFT
    down = y * c - plan.seat * s - plan.low - _LEFT - _BORED * MM * plan.pocket.board.hole * c
    return float(min(_THREAD, inwards / max(c, 1e-9), down / max(s, 1e-9)))


def screws(plan: PrintPlan, k: int) -> tuple[Manifold, Manifold]:
    """Return the posts under a board's holes, and the holes for the screws' threads."""
    board, posts, holes = plan.pocket.board, [], []
    for at in board.holes:
        x, y = on_board(plan, *at)
        deep, hole = thread(plan, y), MM * board.hole
        post = Manifold.cylinder(deep + _LEFT, hole / 2 + _LEFT, -1.0, SMALL).translate(
            (x, y, -plan.seat - deep - _LEFT)
        )
        posts.append(post.transform(plan.frame(k)))
        bored = Manifold.cylinder(deep + 1.0, _BORED * hole, -1.0, SMALL).translate(
            (x, y, -plan.seat - deep)
        )
        holes.append(bored.transform(plan.frame(k)))
    return union(posts), union(holes)


def channel(plan: PrintPlan) -> Manifold:
    """Return the cable groove: around behind the boards, and up to the back of each, so that no
    thin edge remains."""
    wide, c, s = MM * plan.printing.channel, math.cos(plan.tilt), math.sin(plan.tilt)
    low, high, half = (
        plan.top - wide * c,
        plan.top + _OVER,
        MM * (plan.pocket.board.width / 2 + plan.printing.clearance),
    )
    middle, back = (
        -MM * plan.pocket.board.lens[0],
        plan.radius - plan.seat * c - MM * plan.pocket.high * s,
    )
    around = tube(plan.groove[1], low, high) - tube(plan.groove[0], low - 1, high + 1)
    behind = box(
        (plan.groove[0], middle - half, low), (back + wide * s + _OVER, middle + half, high)
    )
    held = union([_upright(plan, k, behind) for k in range(len(plan.angles))])
    return around + held - tube(plan.groove[0], low - 1, high + 1)
