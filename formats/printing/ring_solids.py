"""Solids of a printed ring, by manifold3d: exact Booleans with closed results. Millimetres, print
frame."""

import math
from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, Manifold

from ...coverage.rings import clamp
from ...coverage.rings.ring_envelope import Envelope
from .bolts import bolt_holes, bolts, lugs
from .cable_ties import tie_bridges
from .lettering import lettering
from .primitives import FACETS, SMALL, box, tube, union
from .print_plan import MM, PrintPlan

_FAR = 500.0
FRONT = MM * clamp.FRONT
_THREAD = 8.0  # largest depth of a screw in the ring
_BORED = 0.4  # radius of a screw's thread, relative to the diameter of the hole in the board
_LEFT = 1.5  # material around a screw's hole, and between it and the bore
_OVER = 0.2  # overlap of a cut beyond the surface
_PLUG = 3.0  # half the width of a plug along its edge, or half the edge where that is less
_LIGHT = 12.0  # least length and height of an opening in the sides of a block
_PACKAGE = (4.9, 2.5)  # size of a sensor's package along the ring and up the board


@dataclass(frozen=True)
class Assembly:
    """A mounted ring."""

    parts: list[Manifold]
    """The printed parts; of two halves first the one on the side of +y."""
    boards: list[Manifold]
    """The boards."""
    plugs: list[Manifold]
    """The room of the plugs of each board."""
    bolts: Manifold
    """The bolts."""
    link: Manifold
    """The link."""
    beams: Manifold
    """Union of the beams."""
    letters: Manifold
    """The lettering that is cut out of the parts."""
    ties: int
    """Number of parts with a bridge for a cable tie."""


def collar(plan: PrintPlan) -> Manifold:
    """Return the plain clamp: the band around the link along the whole ring, before it is split."""
    outer = tube(plan.collar, plan.low, plan.lug[1])
    return outer - tube(plan.bore, plan.low - 1, plan.lug[1] + 1)


def _wedge(plan: PrintPlan, k: int, solid: Manifold, inset: float = 0.0) -> Manifold:
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


def _block(plan: PrintPlan, k: int) -> Manifold:
    """Return the block that carries the board of sensor ``k``: from the middle outwards to the
    front of its pocket."""
    size = (plan.outermost, plan.half, plan.top)
    solid = _upright(plan, k, box((0.0, -plan.half, plan.low), size))
    look = plan.frame(k)[:, 2]
    front = float(look @ plan.frame(k)[:, 3]) - plan.rim
    return _wedge(plan, k, solid.trim_by_plane(tuple(-look), -front))


def _window(plan: PrintPlan, k: int) -> Manifold:
    """Return the opening of a block between collar and pocket where they are far apart."""
    end, half = plan.groove[0] - plan.wall, MM * plan.pocket.half - plan.wall
    if half <= 0 or end - plan.collar < plan.wall:
        return Manifold()
    solid = _upright(plan, k, box((0.0, -half, plan.low - 1), (end, half, plan.top + 1)))
    return _wedge(plan, k, solid, (plan.wall + MM * plan.printing.gap) / 2) - tube(
        plan.collar, plan.low - 2, plan.top + 2
    )


def _side_openings(plan: PrintPlan, k: int) -> Manifold:
    """Return the openings in the two walls that a window leaves of a long block, so that ribs
    remain; their roofs of 45 degrees need no support."""
    start, end = plan.collar + plan.wall, plan.groove[0] - 2 * plan.wall
    low, high = plan.low + plan.wall, plan.top - plan.wall
    count = math.ceil((end - start + plan.wall) / (high - low + plan.wall))
    if _window(plan, k).is_empty() or end - start < _LIGHT or high - low < _LIGHT:
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
    return _wedge(plan, k, _upright(plan, k, union(openings)), -_OVER)


def _pocket(plan: PrintPlan, k: int) -> Manifold:
    """Return the space of a board, open in front and above, and of the components behind it."""
    p, board, clear = plan.pocket, plan.pocket.board, MM * plan.printing.clearance
    x, half = -MM * board.lens[0], MM * board.width / 2
    seat, low, high = -plan.seat, MM * p.low, MM * p.high
    high += _OVER
    room = box((x - half - clear, low, seat), (x + half + clear, high, FRONT))
    ledge = 1.0
    relief = box(
        (x - half + ledge, low + ledge, -MM * p.deep), (x + half - ledge, high, seat + 0.1)
    )
    return (room + relief).transform(plan.frame(k))


def _at(plan: PrintPlan, x: float, y: float) -> tuple[float, float]:
    """Convert a point of the board, m from its middle, to the frame of its lens, mm."""
    lens = plan.pocket.board.lens
    return MM * (x - lens[0]), MM * (y - lens[1])


def thread(plan: PrintPlan, y: float) -> float:
    """Return the possible depth of a screw behind a board at height ``y`` up the board, mm from the
    lens."""
    c, s = math.cos(plan.tilt), math.sin(plan.tilt)
    inwards = plan.radius - plan.seat * c - y * s - plan.inner + plan.wall - _LEFT
    down = y * c - plan.seat * s - plan.low - _LEFT - _BORED * MM * plan.pocket.board.hole * c
    return min(_THREAD, inwards / max(c, 1e-9), down / max(s, 1e-9))


def _screws(plan: PrintPlan, k: int) -> tuple[Manifold, Manifold]:
    """Return the posts under a board's holes, and the holes for the screws' threads."""
    board, posts, holes = plan.pocket.board, [], []
    for at in board.holes:
        x, y = _at(plan, *at)
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


def _channel(plan: PrintPlan) -> Manifold:
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


def board(plan: PrintPlan, k: int) -> Manifold:
    """Return the board of sensor ``k`` with its sensor's package, whose front is at the lens."""
    b = plan.pocket.board
    x, y = _at(plan, 0.0, 0.0)
    w, h, front = MM * b.width / 2, MM * b.height / 2, -MM * b.lens_height
    plate = box((x - w, y - h, -plan.seat), (x + w, y + h, front))
    for at in b.holes:
        u, v = _at(plan, *at)
        plate -= Manifold.cylinder(FRONT + plan.seat, MM * b.hole / 2, -1.0, SMALL).translate(
            (u, v, -plan.seat - 1.0)
        )
    if front < 0:
        plate += box(
            (-_PACKAGE[0] / 2, -_PACKAGE[1] / 2, front - 0.1),
            (_PACKAGE[0] / 2, _PACKAGE[1] / 2, 0.0),
        )
    return plate.transform(plan.frame(k))


def plugs(plan: PrintPlan, k: int) -> Manifold:
    """Return the room of the plugs of a board and of the bend of their wires."""
    b = plan.pocket.board
    x, y = _at(plan, 0.0, 0.0)
    w, h, (side, up) = MM * b.width / 2, MM * b.height / 2, (MM * v for v in b.plugs)
    front = -MM * b.lens_height
    ends = (front, front + MM * b.plug_height)
    across, upright = min(_PLUG, w), min(_PLUG, h)
    rooms = []
    for sign in (-1.0, 1.0):
        if up:
            low, high = sorted((y + sign * h, y + sign * (h + up)))
            rooms.append(box((x - across, low, ends[0]), (x + across, high, ends[1])))
        if side:
            low, high = sorted((x + sign * w, x + sign * (w + side)))
            rooms.append(box((low, y - upright, ends[0]), (high, y + upright, ends[1])))
    return union(rooms).transform(plan.frame(k))


def envelope_solid(plan: PrintPlan, envelope: Envelope) -> Manifold:
    """Return an envelope in the print frame; it is not rotated, as it is round.

    Its polygons surround the envelope's circles.
    """
    out = 1 / math.cos(math.pi / FACETS)
    flip = plan.ring.tilt < 0
    solids = []
    for band in (envelope.flipped if flip else envelope).bands:
        low, high = MM * band.low, MM * band.high
        outer = tube(MM * band.outer * out, low, high)
        solids.append(outer - tube(plan.bore, low - 1, high + 1))
    return union(solids)


def beam(plan: PrintPlan, k: int) -> Manifold:
    """Return the beam of sensor ``k``, as far as the ring could intersect it."""
    sensor, length = plan.ring.sensor, min(MM * plan.ring.sensor.range_m, 4 * plan.radius)
    wide, high = (length * math.tan(a) for a in (sensor.half_angle, sensor.half_angle_up))
    if not sensor.square:
        solid = Manifold.cylinder(length, 0.0, wide, 64).translate((0.0, 0.0, 0.0))
    else:
        corners = [(u * wide, v * high, length) for u in (-1, 1) for v in (-1, 1)]
        solid = Manifold.hull_points(np.array([(0.0, 0.0, 0.0), *corners]))
    return solid.transform(plan.frame(k))


def _roof(plan: PrintPlan, shift: float) -> Manifold:
    """Return the region below the split between the sensors, shifted by ``shift`` towards +y."""
    slope, far = math.tan(plan.lean), _FAR
    drop = shift / math.cos(plan.lean)
    roof = [
        (-far, -far * slope + drop),
        (-far, -2 * far),
        (far, -2 * far),
        (far, -far * slope + drop),
        (0.0, drop),
    ]
    return Manifold.hull_points(
        np.array([(*at, z) for at in roof for z in (plan.low - 1, plan.top)])
    )


def _below(plan: PrintPlan, shift: float) -> Manifold:
    """Return the region of the half on the side of -y, shifted by ``shift`` towards +y.

    At the bolts a plane separates the halves; between sensors the split runs midway.
    """
    return _roof(plan, shift) + box((-_FAR, -2 * _FAR, plan.top), (_FAR, shift, plan.lug[1] + 1))


def _arms(plan: PrintPlan) -> Manifold:
    """Return straight walls that extend a half's band where it reaches beyond the middle of the
    link."""
    below, some = _roof(plan, 0.0), []
    for sign in (-1.0, 1.0):
        near, far = sorted((sign * plan.bore, sign * plan.collar))
        some.append(box((near, -plan.collar, plan.low), (far, 0.0, plan.top)) - below)
        some.append(box((near, 0.0, plan.low), (far, plan.collar, plan.top)) ^ below)
    return union(some)


def _ears(plan: PrintPlan) -> Manifold:
    """Return the ears of the bolts, without the support of one where the split between sensors
    leaves too little of it."""
    ears, far = lugs(plan), _FAR
    below, least = _roof(plan, 0.0), plan.wall + MM * plan.printing.gap / 2
    for sign in (-1.0, 1.0):
        split = [-r * math.tan(plan.lean) for r in (plan.bore, plan.ear)]
        side = box(
            (min(0.0, sign * far), -far, plan.low - 1), (max(0.0, sign * far), far, plan.top)
        )
        if min(split) + plan.reach < least:
            ears -= side ^ below
        if plan.reach - max(split) < least:
            ears -= side - below
    return ears


def printed_parts(plan: PrintPlan, bridges: Manifold, cuts: Manifold) -> list[Manifold]:
    """Return the parts of a ring: two halves, or more parts between its joints.

    Args:
        plan: the ring.
        bridges: what is added to the band.
        cuts: what is cut out of it and of the bridges: slots and lettering.
    """
    n = len(plan.angles)
    band = tube(plan.collar, plan.low, plan.lug[1])
    whole = union([band, *(_block(plan, k) for k in range(n))])
    hole = tube(plan.bore, plan.low - 1, plan.lug[1] + 1)
    rooms = union([_pocket(plan, k) for k in range(n)])
    posts, threads = (
        union(list(each)) for each in zip(*(_screws(plan, k) for k in range(n)), strict=True)
    )
    light = union([_window(plan, k) + _side_openings(plan, k) for k in range(n)])
    cut = whole - light + _ears(plan) - rooms - _channel(plan)
    cut = cut + (bridges - rooms)
    body = cut + (posts ^ whole) + (_arms(plan) - rooms) - hole - threads - bolt_holes(plan) - cuts
    gap = MM * plan.printing.gap / 2
    if len(plan.joints) > 2:
        return [_dusted(_between(body, arc, gap)) for arc in plan.arcs]
    low, high = plan.low - 1, plan.lug[1] + 1
    # paths of the link into the halves
    down = box((-plan.bore, -_FAR, low), (plan.bore, 0.0, high))
    up = box((-plan.bore, 0.0, low), (plan.bore, _FAR, high))
    return [_dusted(body - _below(plan, gap) - down), _dusted((body ^ _below(plan, -gap)) - up)]


def _between(solid: Manifold, arc: tuple[float, float], inset: float) -> Manifold:
    """Return the part of a solid within an arc of at most half a turn, ``inset`` mm from both
    ends."""
    a, b = arc
    some = solid.trim_by_plane((-math.sin(a), math.cos(a), 0.0), inset)
    return some.trim_by_plane((math.sin(b), -math.cos(b), 0.0), inset)


def _dusted(solid: Manifold) -> Manifold:
    """Remove pieces of less than one cubic millimetre, which Booleans of touching faces may
    leave."""
    return union([piece for piece in solid.decompose() if piece.volume() > 1.0])


def assemble(plan: PrintPlan) -> Assembly:
    """Return a mounted ring."""
    n, length = len(plan.angles), 2 * (plan.lug[1] - plan.low)
    link = tube(plan.link, plan.low - length / 2, plan.lug[1] + length / 2)
    boards, rooms = [board(plan, k) for k in range(n)], [plugs(plan, k) for k in range(n)]
    beams = union([beam(plan, k) for k in range(n)])
    bridges, slots, arcs = tie_bridges(plan, [beams, *boards, *rooms])
    letters = union([lettering(plan, i, arc) for i, arc in enumerate(arcs) if plan.label])
    parts = printed_parts(plan, union(bridges), union(slots) + letters)
    return Assembly(parts, boards, rooms, bolts(plan), link, beams, letters, len(bridges))
