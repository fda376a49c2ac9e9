"""Measurements of the lids of a printed ring with their limits."""

from manifold3d import Manifold

from ...coverage.rings.ring_envelope import Envelope
from ...coverage.sensors.lids import MARGIN
from ..schema.print_models import PrintCheck
from .lids import lid_solid
from .primitives import union
from .print_checks import (
    NEAR,
    NOTHING,
    least_wall,
    neighbours,
    open_edges,
    overhang,
    print_check,
    read_stl,
)
from .print_plan import MM, PrintPlan
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
        print_check("open edges in the file of a lid", float(open_edges(mesh)), "", most=0.0),
        print_check("separate pieces of a lid", float(len(one.decompose())), "", most=1.0),
        print_check("least wall of a lid", least_wall(one), "mm", least=MM * p.least_wall),
        print_check(
            "overhang of a lid beyond 45°", 100 * overhang(mesh), "%", most=100 * p.overhang
        ),
        print_check("overlap of lids and ring", _overlap(covers, ring), "mm³", most=NOTHING),
        print_check("overlap of lids and boards", _overlap(covers, boards), "mm³", most=NOTHING),
        print_check("distance between lids", neighbours(made.lids), "mm", least=MM * p.clearance),
        print_check(
            "distance from lids to bolts",
            covers.min_gap(made.bolts, NEAR),
            "mm",
            least=MM * p.clearance,
        ),
        print_check(
            "distance from lids to link", covers.min_gap(made.link, NEAR), "mm", least=MM * p.slack
        ),
        print_check(
            "distance from beams to lids", made.beams.min_gap(lids, NEAR), "mm", least=MM * MARGIN
        ),
        print_check(
            "overlap of beams with lids and screws",
            _overlap(made.beams, covers),
            "mm³",
            most=NOTHING,
        ),
        print_check(
            "volume of lids outside the envelope",
            (covers - envelope_solid(plan, envelope)).volume(),
            "mm³",
            most=NOTHING,
        ),
    ]


def _overlap(one: Manifold, other: Manifold) -> float:
    """Return the volume, mm³, that two solids have in common."""
    return float((one ^ other).volume())
