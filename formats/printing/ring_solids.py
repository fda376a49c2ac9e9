"""Solids of a printed ring, by manifold3d: exact Booleans with closed results. Millimetres, print
frame."""

import math
from dataclasses import dataclass, field

import numpy as np
from manifold3d import Manifold

from ...coverage.rings.ring_envelope import Envelope
from .blocks import block, channel, pocket, screws, side_openings, window
from .bolts import bolt_holes, bolts, lugs
from .cable_ties import tie_bridges
from .lettering import lettering
from .lids import lid_rooms, mounted_lids, screw_heads
from .mounted_boards import beam, board, plugs
from .primitives import FACETS, box, tube, union
from .print_plan import MM, PrintPlan

_FAR = 500.0


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
    lids: list[Manifold] = field(default_factory=list)
    """The lid of each board; none without lids."""
    heads: list[Manifold] = field(default_factory=list)
    """The heads of the screws on each lid."""


def collar(plan: PrintPlan) -> Manifold:
    """Return the plain clamp: the band around the link along the whole ring, before it is split."""
    outer = tube(plan.collar, plan.low, plan.lug[1])
    return outer - tube(plan.bore, plan.low - 1, plan.lug[1] + 1)


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
    whole = union([band, *(block(plan, k) for k in range(n))])
    hole = tube(plan.bore, plan.low - 1, plan.lug[1] + 1)
    rooms = union([*(pocket(plan, k) for k in range(n)), lid_rooms(plan)])
    posts, threads = (
        union(list(each)) for each in zip(*(screws(plan, k) for k in range(n)), strict=True)
    )
    light = union([window(plan, k) + side_openings(plan, k) for k in range(n)])
    cut = whole - light + _ears(plan) - rooms - channel(plan)
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
    lids, heads = mounted_lids(plan), screw_heads(plan)
    bridges, slots, arcs = tie_bridges(plan, [beams, *boards, *rooms, *lids, *heads])
    letters = union([lettering(plan, i, arc) for i, arc in enumerate(arcs) if plan.label])
    parts = printed_parts(plan, union(bridges), union(slots) + letters)
    ties, closed = len(bridges), bolts(plan)
    return Assembly(parts, boards, rooms, closed, link, beams, letters, ties, lids, heads)
