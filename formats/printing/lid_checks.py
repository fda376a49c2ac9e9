"""Measurements of the lids of a printed ring with their limits."""

from ...coverage.rings.ring_envelope import Envelope
from ...coverage.sensors.lids import MARGIN
from ..schema.print_models import PrintCheck
from .lids import lid_solid
from .primitives import union
from .print_checks import (
    NEAR,
    at_least,
    at_most,
    least_wall,
    neighbours,
    nothing,
    open_edges,
    overhang,
    pieces,
    read_stl,
)
from .print_plan import PrintPlan
from .ring_solids import Assembly, envelope_solid


def check_lids(
    plan: PrintPlan, made: Assembly, data: bytes, envelope: Envelope
) -> list[PrintCheck]:
    """Return all measurements of the lids of a ring.

    Args:
        plan: the ring.
        made: its solids.
        data: STL file of a lid.
        envelope: the solid that must contain the mounted ring.
    """
    mesh, p, lids = read_stl(data), plan.printing, union(made.lids)
    covers, ring = lids + union(made.heads), union([*made.parts, made.bolts])
    boards = union([*made.boards, *made.plugs])
    one = lid_solid(plan)
    return [
        at_most("open edges in the file of a lid", open_edges(mesh), "", 0.0),
        at_most("separate pieces of a lid", pieces(one), "", 1.0),
        at_least("least wall of a lid", least_wall(one), p.least_wall),
        at_most("overhang of a lid beyond 45°", 100 * overhang(mesh), "%", 100 * p.overhang),
        nothing("overlap of lids and ring", covers ^ ring),
        nothing("overlap of lids and boards", covers ^ boards),
        at_least("distance between lids", neighbours(made.lids), p.clearance),
        at_least("distance from lids to bolts", covers.min_gap(made.bolts, NEAR), p.clearance),
        at_least("distance from lids to link", covers.min_gap(made.link, NEAR), p.slack),
        at_least("distance from beams to lids", made.beams.min_gap(lids, NEAR), MARGIN),
        nothing("overlap of beams with lids and screws", made.beams ^ covers),
        nothing("volume of lids outside the envelope", covers - envelope_solid(plan, envelope)),
    ]
