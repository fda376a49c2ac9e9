"""Colours of the viewer and their legend, from Okabe and Ito's colour-blind safe palette."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from ..reporting.rendering.colours import UNSEEN_COLOUR
from .quick_estimate import ONCE, SHADOWED, TWICE, UNSEEN

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


KINDS = (
    DrawingKind(UNSEEN, "uncovered", UNSEEN_COLOUR, 0.0054),
    DrawingKind(SHADOWED, "shadowed: in a cone, but occluded", "#000000", 0.0054),
    DrawingKind(ONCE, "covered by one sensor", "#56B4E9", 0.0029),
    DrawingKind(TWICE, "covered by two or more", "#0072B2", 0.0029),
)
# no blues: points use them
_LINKS = ("#009E73", "#CC79A7", "#E69F00", "#F0E442", "#7A5230", "#999999")
ROBOT, CURVE, OUTLINE, OBSTACLE, SENSOR, FLOOR = (
    "#b4bbc3",
    "#23272b",
    "#8f8a80",
    "#c9b48c",
    "#23272b",
    "#d9dde1",
)


def link_colours(links: Sequence[str]) -> dict[str, str]:
    """Return the colour of each link's rings and beams."""
    return dict(zip(links, cycle(_LINKS), strict=False))
