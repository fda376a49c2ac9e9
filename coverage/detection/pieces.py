"""Test pieces: the objects whose detection is predicted."""

from typing import Annotated

from pydantic import Field

from ..definitions.definition import definition
from ..definitions.field_types import Metres, Text

DARK = 0.018
"""Lowest reflectance that a protective device must detect (IEC 61496-3, by a vendor's page)."""
_Line = Annotated[str, Field(max_length=1000)]


@definition(kw_only=True)
class TestPiece:
    """An object that sensors should detect: its silhouette, seen from the sensor, and reflectance.

    It stands upright, and its place is that of its centre. The silhouette is that of a round body:
    it looks the same from all sides.
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

    @property
    def half(self) -> float:
        """Half of the smaller side, m."""
        return min(self.width_m, self.height_m) / 2


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
