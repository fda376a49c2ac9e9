"""Bolts that hold a ring's parts together, the ears that carry them, and their holes. Millimetres,
print frame."""

import math

import numpy as np
from manifold3d import CrossSection, Manifold

from ...coverage.rings import clamp
from .primitives import SMALL, union
from .print_plan import MM, PrintPlan

_COVER = MM * clamp.NUT_COVER
# mm, lengths of screws M1.6 to M5 as shops sell them (ISO 4762, ISO 7045)
_SOLD = (3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 70, 80, 90, 100)
_ROUNDING = 1e-6  # mm, rounding
_ROOT = 0.5  # mm, extension of an ear's slope into the collar, whose facets lie inside its radius


def lugs(plan: PrintPlan) -> Manifold:
    """Return the ears for the bolts; a slope of 45 degrees on the collar supports them."""
    low, high = plan.lug
    end = plan.ear
    foot = plan.collar - min(_ROOT, (plan.collar - plan.bore) / 2)
    ends = [
        (plan.bore, low),
        (plan.bore, high),
        (end, high),
        (end, low),
        (foot, low - (end - foot)),
        (plan.bore, low - (end - foot)),
    ]
    outline = CrossSection.hull_points(np.array(ends))
    ear = outline.extrude(2 * plan.reach).rotate((90.0, 0.0, 0.0)).translate((0.0, plan.reach, 0.0))
    return at_joints(plan, ear)


def at_joints(plan: PrintPlan, solid: Manifold) -> Manifold:
    """Return a solid, given at the joint of azimuth 0, at all joints.

    The two joints of two halves mirror each other, so that both bolts have their heads on the same
    half.
    """
    if len(plan.joints) == 2:
        return union([solid, solid.mirror((1.0, 0.0, 0.0))])
    return union([solid.rotate((0.0, 0.0, math.degrees(a))) for a in plan.joints])


def bolt_holes(plan: PrintPlan) -> Manifold:
    """Return bores with a 45-degree roof, and room for nuts or inserts on one side of the joints,
    which is -y at azimuth 0."""
    r = plan.bolt.hole / 2
    circle = CrossSection.circle(r, SMALL)
    tip = CrossSection.hull_points(
        np.array(
            [
                (0.0, -r * math.sqrt(2)),
                (r / math.sqrt(2), -r / math.sqrt(2)),
                (-r / math.sqrt(2), -r / math.sqrt(2)),
            ]
        )
    )
    holes = (circle + tip).extrude(4 * plan.reach).translate((0.0, 0.0, -2 * plan.reach))
    if plan.printing.fastening == "insert":
        insert, deep = _insert(plan), MM * clamp.MELT
        room = Manifold.cylinder(insert.length + deep + 1.0, insert.hole / 2, -1.0, SMALL)
        holes += room.translate((0.0, 0.0, -plan.reach - 1.0))
    elif plan.printing.nut == "trap":
        holes += _nut(plan, MM * clamp.NUT_CLEARANCE).translate(
            (0.0, 0.0, -plan.reach - 10.0 + plan.bolt.nut_height + _COVER)
        )
    return _across(plan, holes)


def bolts(plan: PrintPlan) -> Manifold:
    """Return all bolts with heads, and their nuts or inserts."""
    b, reach = plan.bolt, plan.reach
    shaft = Manifold.cylinder(2 * reach, b.size / 2, -1.0, SMALL).translate((0.0, 0.0, -reach))
    head = Manifold.cylinder(b.size, b.head / 2, -1.0, SMALL).translate((0.0, 0.0, reach))
    if plan.printing.fastening == "insert":
        insert = _insert(plan)
        held = Manifold.cylinder(insert.length, insert.hole / 2, -1.0, SMALL)
        return _across(plan, shaft + head + held.translate((0.0, 0.0, -reach)))
    trapped = plan.reach - b.nut_height - _COVER if plan.printing.nut == "trap" else plan.reach
    nut = _nut(plan, 0.0, b.nut_height).translate((0.0, 0.0, -trapped - b.nut_height))
    return _across(plan, shaft + head + nut)


def fastening(plan: PrintPlan) -> str:
    """Return the bolts and what they are screwed into, as a person buys them."""
    (bolt, held), count = fasteners(plan), len(plan.joints)
    return f"{count} × {bolt}, {count} × {held}"


def longest_sold(most: float) -> float:
    """Return the longest screw that is sold with at most ``most`` mm; 0 if there is none."""
    return max((length for length in _SOLD if length <= most + _ROUNDING), default=0)


def shortest_sold(least: float) -> float:
    """Return the shortest screw that is sold with at least ``least`` mm, or ``least`` rounded up
    beyond the longest."""
    longer = (length for length in _SOLD if length >= least - _ROUNDING)
    return next(longer, math.ceil(least))


def fasteners(plan: PrintPlan) -> tuple[str, str]:
    """Return the kind of bolt and of what it is screwed into; a ring has one of each per joint."""
    b = plan.bolt
    if plan.printing.fastening == "insert":
        insert = _insert(plan)
        return (
            f"M{b.size:.0f} × {shortest_sold(2 * plan.reach - insert.length + b.size)} mm bolt",
            f"heat-set insert M{b.size:.0f} × {insert.length:.1f} mm in a hole of"
            f" {insert.hole:.1f} mm ({clamp.INSERT_SOURCE})",
        )
    through = 2 * plan.reach + (0.0 if plan.printing.nut == "trap" else b.nut_height)
    return f"M{b.size:.0f} × {shortest_sold(through)} mm bolt", f"nut M{b.size:.0f}"


def _insert(plan: PrintPlan) -> clamp.Insert:
    """Return the heat-set insert of a plan's bolts, mm."""
    insert = clamp.INSERTS[round(plan.bolt.size)]
    return clamp.Insert(MM * insert.hole, MM * insert.length)


def _across(plan: PrintPlan, solid: Manifold) -> Manifold:
    """Lay a solid about the z axis across all joints; at azimuth 0, its +z axis points to +y."""
    laid = solid.rotate((-90.0, 0.0, 0.0))
    return at_joints(plan, laid.translate((plan.across, 0.0, sum(plan.lug) / 2)))


def _nut(plan: PrintPlan, clear: float, height: float = 10.0) -> Manifold:
    return Manifold.cylinder(
        height, (plan.bolt.nut / 2 + clear) / math.cos(math.pi / 6), -1.0, 6
    ).rotate((0.0, 0.0, 30.0))
