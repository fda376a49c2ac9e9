"""Bridges on a ring's band to which cable ties hold the cables (strain relief). Millimetres, print
frame."""

import math

import numpy as np
from manifold3d import CrossSection, Manifold

from .primitives import box, tube, union
from .print_plan import MM, PrintPlan

SLOT = (1.6, 3.2)
"""Depth and height of the slot under a bridge, mm: for a tie of 2.5 × 1.1 mm."""
_ROOF, _EDGE = 1.6, 1.5  # thickness of the bridge, and of its ends above and below the slot
_HALF = 4.0  # half its width along the band
_ASIDE = 3.0  # between a bridge and an ear, for the tie
_CLEAR = 1.5  # between lettering and the head of a bolt
_ROOT = 1.5  # extent of a bridge into the band


def tie_bridges(
    plan: PrintPlan, occupied: list[Manifold]
) -> tuple[list[Manifold], list[Manifold], list[tuple[float, float]]]:
    """Return bridges and their slots, at most one on each part, and each part's arc without them.

    A bridge stands beside a joint, where it is clear of all beams, boards and plugs, and does not
    bar the way of a bolt, nut or screwdriver.

    Args:
        plan: the ring.
        occupied: beams, boards, plugs and lids.
    """
    bridges, slots, free = list[Manifold](), list[Manifold](), list[tuple[float, float]]()
    high = plan.lug[1]
    out = plan.collar + SLOT[0] + _ROOF
    fits = high - _foot(plan) <= plan.lug[1] - plan.lug[0]
    # beside the ears and beyond the straight path of a bolt, whose head touches the band
    path = max((plan.reach + _ASIDE) / plan.collar, math.acos(plan.collar / out))
    beside = path + _HALF / plan.collar
    for first, last in plan.arcs:
        ear = (plan.reach + plan.bolt.size + _CLEAR) / plan.collar  # with a bolt's head
        arc = (first + ear, last - ear)
        for at in (last - beside, first + beside) if plan.printing.ties and fits else ():
            turn = (0.0, 0.0, math.degrees(at))
            bridge = _bridge(plan, out).rotate(turn)
            clear = bridge.min_gap(union(occupied[1:]), 5.0) >= MM * plan.printing.clearance
            if last - first < 3 * beside or not clear or (bridge ^ occupied[0]).volume() > 0:
                continue
            bridges.append(bridge)
            low = high - _EDGE - SLOT[1]
            slot = box((plan.bore, -9.0, low), (plan.collar + SLOT[0], 9.0, low + SLOT[1]))
            slots.append(slot.rotate(turn) - tube(plan.collar, plan.low - 1, high + 1))
            end = (_HALF + _ASIDE) / plan.collar
            arc = (arc[0], at - end) if at > (first + last) / 2 else (at + end, arc[1])
            break
        free.append(arc)
    return bridges, slots, free


def _foot(plan: PrintPlan) -> float:
    """Return the lower end of a bridge's slope."""
    return float(plan.lug[1]) - 2 * _EDGE - SLOT[1] - SLOT[0] - _ROOF


def _bridge(plan: PrintPlan, out: float) -> Manifold:
    """Return the bridge at azimuth 0, with a slope of 45 degrees below it, without its slot."""
    high, foot, root = plan.lug[1], _foot(plan), min(_ROOT, (plan.collar - plan.bore) / 2)
    inside = plan.collar - root
    outline = [
        (inside, foot - root),
        (plan.collar, foot),
        (out, foot + out - plan.collar),
        (out, high),
        (inside, high),
    ]
    flat = CrossSection.hull_points(np.array(outline))
    return flat.extrude(2 * _HALF).rotate((90.0, 0.0, 0.0)).translate((0.0, _HALF, 0.0))
