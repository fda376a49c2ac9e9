"""Parts of the printed rings: filament, and what closes the rings and holds the boards."""

import re
from collections import Counter
from dataclasses import dataclass, field

from ...coverage.rings.ring import Setup
from ...formats.printing.print_checks import read_stl
from ...formats.printing.print_files import print_ring
from ...formats.printing.print_plan import MM, UnbuildableError
from ...objectives.scene import CoreScene

DENSITY = 1.27  # g/cm³, of PETG
_NEXT = re.compile(r", (?=\d+ (?:nut|heat-set))")  # between two kinds of parts
_NUMBER = re.compile(r"(\d+) (?:× )?(.+)")


@dataclass
class PrintedParts:
    """Parts of all printed rings of a setup."""

    hardware: Counter[str] = field(default_factory=Counter)
    """Number of bolts and screws by their text."""
    grams: float = 0.0
    """Mass of the rings if they are printed solid, g."""
    rings: int = 0
    """Number of rings that can be printed."""
    reasons: list[str] = field(default_factory=list)
    """Why each other ring cannot be printed."""


def printed_parts(scene: CoreScene, setup: Setup) -> PrintedParts:
    """Return the parts of all rings of a setup that can be printed."""
    parts = PrintedParts()
    for number, ring in enumerate(setup.rings):
        try:
            record, files, *_ = print_ring(scene, number, ring)
        except UnbuildableError as error:
            parts.reasons.append(str(error))
            continue
        parts.grams += DENSITY * sum(float(read_stl(file).volume) for file in files) / MM
        parts.rings += 1
        for kind, text in (("to close the rings", record.bolts), ("for the boards", record.screws)):
            for one in _NEXT.split(" ".join(text.split())):
                if match := _NUMBER.fullmatch(one):
                    parts.hardware[f"{match[2]} ({kind})"] += int(match[1])
    return parts
