"""Parts of the printed rings: filament, and what closes the rings and holds the boards."""

from collections import Counter
from dataclasses import dataclass, field

from ...coverage.rings.ring import Setup
from ...formats.printing.bolts import fasteners
from ...formats.printing.payload import PLASTIC
from ...formats.printing.print_checks import read_stl
from ...formats.printing.print_files import board_screws, print_ring
from ...formats.printing.print_plan import MM, UnbuildableError
from ...objectives.scene import Scene

DENSITY = PLASTIC / 1000  # g/cm³


@dataclass
class PrintedParts:
    """Parts of all printed rings of a setup."""

    hardware: Counter[str] = field(default_factory=Counter)
    """Number of bolts and screws by their text."""
    grams: float = 0.0
    """Mass of the rings and lids if they are printed solid, g."""
    lids: int = 0
    """Number of lids of the rings' boards."""
    rings: int = 0
    """Number of rings that can be printed."""
    reasons: list[str] = field(default_factory=list)
    """Why each other ring cannot be printed."""


def printed_parts(scene: Scene, setup: Setup) -> PrintedParts:
    """Return the parts of all rings of a setup that can be printed."""
    parts = PrintedParts()
    for number, ring in enumerate(setup.rings):
        try:
            record, files, plan, _ = print_ring(scene, number, ring)
        except UnbuildableError as error:
            parts.reasons.append(str(error))
            continue
        volumes = [float(read_stl(file).volume) for file in files]
        if record.lids:  # whose file is the last
            volumes[-1] *= record.lids.copies
            parts.lids += record.lids.copies
        parts.grams += DENSITY * sum(volumes) / MM
        parts.rings += 1
        for kind in fasteners(plan):
            parts.hardware[f"{kind} (to close the rings)"] += len(plan.joints)
        if screws := board_screws(plan):
            held = "boards and lids" if record.lids else "boards"
            parts.hardware[f"{screws[1]} (for the {held})"] += screws[0]
    return parts
