"""Test pieces: the objects whose detection is predicted."""

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from ..definitions.definition import definition, fault
from ..definitions.field_types import Metres, Text
from ..sensors.effective_range import size_of

DARK = 0.018
"""Lowest reflectance that a protective device must detect (IEC 61496-3, by a vendor's page)."""
_Line = Annotated[str, Field(max_length=1000)]


@definition(kw_only=True)
class TestPiece:
    """An object that sensors should detect: an upright round body of one reflectance.

    It is a cylinder about the vertical of the base frame, and its place is that of its centre.
    """

    __test__ = False  # no test of pytest's

    name: Text
    """Name."""
    width_m: Metres
    """Width, m; of a rod its diameter."""
    height_m: Metres
    """Height, m."""
    reflectance: Annotated[float, Field(gt=0, le=1)] = DARK
    """Reflectance, as a share."""
    source: _Line = ""
    """Source of the figures."""


_PIECES = (
    TestPiece(
        name="torso",
        width_m=0.45,
        height_m=0.7,
        source="the makers' example of a torso, 450 × 700 mm, for the rule of partial filling",
    ),
    TestPiece(
        name="person",
        width_m=0.45,
        height_m=1.7,
        source="assumption: as wide as the makers' torso, and as tall as a person",
    ),
    TestPiece(name="arm", width_m=0.08, height_m=0.4, source="assumption: a forearm in a sleeve"),
    TestPiece(
        name="hand",
        width_m=0.08,
        height_m=0.18,
        reflectance=0.17,
        source="assumption: a gloved hand, as dark as the makers' grey target",
    ),
    TestPiece(
        name="leg",
        width_m=0.04,
        height_m=0.4,
        source="the makers' example of a leg 40 mm wide, for the rule of partial filling",
    ),
    *(
        TestPiece(
            name=f"rod-{d}",
            width_m=d / 1000,
            height_m=0.3,
            source=f"test rod of {d} mm, as for protective devices of that resolution; length:"
            " assumption",
        )
        for d in (14, 40, 70)
    ),
)
PIECES = {piece.name: piece for piece in _PIECES}
"""Test pieces by name."""
PIECE_TEXT = f"{', '.join(PIECES)}, rod-DIAMETER in mm (1 to 999), or WIDTHxHEIGHT in m"
"""What a text may be that names a test piece."""
_OWN = "the size is the user's own"


def piece_of(text: str) -> TestPiece:
    """Return the test piece that a text names: one of ``PIECES``, a rod such as rod-55 for 55 mm,
    or a size such as 0.1x0.4, m.

    Raises:
        ValueError: if the text names none.
    """
    if text in PIECES:
        return PIECES[text]
    if rod := re.fullmatch(r"rod-([1-9]\d{0,2})", text):
        return TestPiece(name=text, width_m=int(rod[1]) / 1000, height_m=0.3, source=_OWN)
    try:
        width, height = size_of(text)
        return TestPiece(name=text[:100], width_m=width, height_m=height, source=_OWN)
    except ValueError:
        raise ValueError(f"found {text[:60]!r}, allowed: {PIECE_TEXT}") from None


def _named(value: Any) -> Any:
    try:
        return piece_of(value) if isinstance(value, str) else value
    except ValueError:
        raise fault(value, f"{PIECE_TEXT}, or a table") from None


Piece = Annotated[TestPiece, BeforeValidator(_named, json_schema_input_type=str | TestPiece)]
"""A test piece, or a text that names one."""
