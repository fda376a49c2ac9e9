"""The files of printed rings: two halves of each as STL, and what was measured."""

import math
from collections.abc import Callable, Mapping

from ...coverage.rings.ring import Ring, Setup
from ...coverage.sensors.board_packing import Printing
from ...objectives.scene import Scene
from ..errors import UserError
from ..schema.print_models import PrintedRing, PrintResult
from .print_checks import check_ring, stl
from .print_plan import MM, PrintPlan, UnbuildableError, plan_ring
from .ring_solids import Assembly, assemble, thread

ASSEMBLED = "assembled.png"  # the picture of the first ring with boards and bolts


def print_ring(
    scene: Scene, number: int, ring: Ring, printing: Printing | None = None
) -> tuple[PrintedRing, tuple[bytes, bytes], PrintPlan, Assembly]:
    """A ring as it is printed: its record, its halves as STL, and what they were made from.

    Raises:
        UnbuildableError: if it cannot be built, or a check does not hold.
    """
    plan = plan_ring(scene, ring, printing)
    made = assemble(plan)
    files = (stl(made.halves[0]), stl(made.halves[1]))
    checks = check_ring(plan, made, files)
    for check in checks:
        if not check.holds:
            allowed = (
                f"at least {check.least:.4g}"
                if check.least is not None
                else f"at most {check.most:.4g}"
            )
            raise UnbuildableError(
                f"{check.name}: found {check.measured:.4g} {check.unit}, allowed: {allowed}"
            )
    name, board, bolt = f"ring{number}_{_plain(ring.link)}", plan.pocket.board, plan.bolt
    deep = min((thread(plan, MM * (y - board.lens[1])) for _, y in board.holes), default=0.0)
    low, high = made.halves[0].bounding_box()[:3], made.halves[0].bounding_box()[3:]
    count = ring.count * len(board.holes)
    record = PrintedRing(
        ring=number,
        link=ring.link,
        position_mm=MM * ring.position * scene.robot.mount(ring.link).length,
        count=ring.count,
        tilt_deg=round(math.degrees(ring.tilt), 4),
        radius_mm=plan.radius,
        bore_mm=2 * plan.bore,
        size_mm=[b - a for a, b in zip(low, high, strict=True)],
        flipped=ring.tilt < 0,
        board=board.source,
        screws=f"{count} × M{_screw(MM * board.hole):g}, {deep:.1f} mm of thread"
        if count
        else "none: glue",
        bolts=f"2 × M{bolt.size:.0f}, {2 * plan.reach + bolt.nut_height:.0f} mm and more",
        files=[f"{name}_a.stl", f"{name}_b.stl", f"{name}.png"],
        checks=checks,
    )
    return record, files, plan, made


def _screw(hole: float) -> float:
    """The thickest screw, mm, that goes through a hole of a board; the hole itself where that is
    finer than all.
    """
    return max(
        (size for size in (1.6, 2.0, 2.5, 3.0, 4.0, 5.0) if size <= hole + 1e-9), default=hole
    )


def _plain(link: str) -> str:
    """A link's name as part of a file's name."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in link)[:60]


Drawing = Callable[[PrintPlan, Assembly, PrintedRing], Mapping[str, bytes]]
"""Makes the pictures of a ring, by their names."""


def ring_files(
    setup: Setup, scene: Scene, drawing: Drawing, printing: Printing | None = None
) -> tuple[PrintResult, dict[str, bytes]]:
    """The rings of ``setup`` as they are printed, ``printing`` in place of the scene's: their
    records, and the files by name, two STL files of each ring and its pictures, and
    ``printing.json``.

    Raises:
        UserError: if a ring cannot be built; it names the ring, the reason and the largest count
            that fits.
    """
    records, data = list[PrintedRing](), dict[str, bytes]()
    for number, ring in enumerate(setup.rings):
        try:
            record, files, plan, made = print_ring(scene, number, ring, printing)
        except UnbuildableError as error:
            raise UserError(f"ring {number} ({ring.link}): {error}") from error
        records.append(record)
        data |= dict(zip(record.files[:2], files, strict=True))
        data |= drawing(plan, made, record)
    result = PrintResult(rings=records, assembled=ASSEMBLED)
    data["printing.json"] = (result.model_dump_json(indent=2) + "\n").encode()
    return result, data
