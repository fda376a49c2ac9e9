"""Bolts that hold a ring's halves together, the ears that carry them, and their holes. Millimetres,
print frame."""

import math

import numpy as np
from manifold3d import CrossSection, Manifold

from ...coverage.rings import clamp
from .primitives import SMALL, union
from .print_plan import MM, PrintPlan

_COVER = MM * clamp.NUT_COVER
_ROOT = 0.5  # mm, extension of an ear's slope into the collar, whose facets lie inside its radius


def lugs(plan: PrintPlan) -> Manifold:
    """Return the ears for the bolts; a slope of 45 degrees on the collar supports them."""
    low, high = plan.lug
    end = plan.ear
    foot = plan.collar - min(_ROOT, (plan.collar - plan.bore) / 2)
    some = []
    for sign in (-1.0, 1.0):
        ends = [
            (plan.bore, low),
            (plan.bore, high),
            (end, high),
            (end, low),
            (foot, low - (end - foot)),
            (plan.bore, low - (end - foot)),
        ]
        outline = CrossSection.hull_points(np.array(ends))
        ear = (
            outline.extrude(2 * plan.reach)
            .rotate((90.0, 0.0, 0.0))
            .translate((0.0, plan.reach, 0.0))
        )
        ear = ear if sign > 0 else ear.mirror((1.0, 0.0, 0.0))
        some.append(ear)
    return union(some)


def bolt_holes(plan: PrintPlan) -> Manifold:
    """Return bores with a 45-degree roof, and traps for the nuts on the side of -y."""
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
    if plan.printing.nut:
        holes += _nut(plan, MM * clamp.NUT_CLEARANCE).translate(
            (0.0, 0.0, -plan.reach - 10.0 + plan.bolt.nut_height + _COVER)
        )
    return _across(plan, holes)


def bolts(plan: PrintPlan) -> Manifold:
    """Return both bolts with heads and nuts."""
    b, reach = plan.bolt, plan.reach
    trapped = plan.reach - b.nut_height - _COVER if plan.printing.nut else plan.reach
    shaft = Manifold.cylinder(2 * reach, b.size / 2, -1.0, SMALL).translate((0.0, 0.0, -reach))
    head = Manifold.cylinder(b.size, b.head / 2, -1.0, SMALL).translate((0.0, 0.0, reach))
    nut = _nut(plan, 0.0, b.nut_height).translate((0.0, 0.0, -trapped - b.nut_height))
    return _across(plan, shaft + head + nut)


def _across(plan: PrintPlan, solid: Manifold) -> Manifold:
    """Lay a solid about the z axis along y at both bolts; its +z axis points to +y."""
    z = sum(plan.lug) / 2
    laid = solid.rotate((-90.0, 0.0, 0.0))
    return union([laid.translate((sign * plan.across, 0.0, z)) for sign in (-1, 1)])


def _nut(plan: PrintPlan, clear: float, height: float = 10.0) -> Manifold:
    return Manifold.cylinder(
        height, (plan.bolt.nut / 2 + clear) / math.cos(math.pi / 6), -1.0, 6
    ).rotate((0.0, 0.0, 30.0))
