"""Colours of the viewer and their legend, from Okabe and Ito's colour-blind safe palette."""

from dataclasses import dataclass

from ..formats.export.palette import (
    COVERED_ONCE,
    COVERED_TWICE,
    OBSTACLE,
    ROBOT,
    SENSOR,
    UNCOVERED,
    WARNING,
    link_colours,
)
from ..formats.export.palette import SHADOWED as SHADOWED_COLOUR
from .quick_estimate import ONCE, SHADOWED, TWICE, UNSEEN

__all__ = [
    "OBSTACLE",
    "ROBOT",
    "SENSOR",
    "WARNING",
    "link_colours",
]  # of the palette
Rgb = tuple[int, int, int]


def rgb(colour: str) -> Rgb:
    """Return ``#rrggbb`` as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


@dataclass(frozen=True)
class DrawingKind:
    """A class of target points."""

    number: int
    """Value of ``PointVerdict.kind``."""
    words: str
    """Text of the legend; the part before a colon is its short form."""
    colour: str
    """Colour as ``#rrggbb``."""
    size: float
    """Size of a point where few are uncovered, as a share of the target's diagonal."""
    covered: bool = False
    """Whether a sensor covers such points."""


KINDS = (
    DrawingKind(UNSEEN, "uncovered", UNCOVERED, 0.0054),
    DrawingKind(SHADOWED, "shadowed: in a cone, but occluded", SHADOWED_COLOUR, 0.0054),
    DrawingKind(ONCE, "covered by one sensor", COVERED_ONCE, 0.0034, True),
    DrawingKind(TWICE, "covered by two or more", COVERED_TWICE, 0.0034, True),
)
CURVE, OUTLINE, FLOOR = "#23272b", "#8f8a80", "#d9dde1"
SPHERES = ("#fde725", "#90d743", "#35b779", "#21918c", "#31688e", "#443983")
"""Colours of the classes of diameters of unseen spheres, from small to large: viridis."""
LARGEST = "#d1245b"  # the largest unseen sphere, as in reports
_ON_DARK = {
    **dict(zip(SPHERES, reversed(SPHERES), strict=True)),
    **{SHADOWED_COLOUR: "#f4f4f4", CURVE: "#e8eaed", FLOOR: "#2a2d31", OUTLINE: "#4a4843"},
}


def on_page(colour: str, dark: bool) -> str:
    """Return a colour as it is drawn: on a dark page, what is nearly black becomes nearly white."""
    return _ON_DARK.get(colour, colour) if dark else colour
