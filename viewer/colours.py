"""What is shown in which colour, and the words that say so: colours of Okabe and Ito, told apart by
every colour vision.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from ..reporting.rendering.canvas import UNSEEN_COLOUR
from .quick_estimate import ONCE, SHADOWED, TWICE, UNSEEN

Rgb = tuple[int, int, int]


def rgb(colour: str) -> Rgb:
    """``#rrggbb`` as three numbers up to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


@dataclass(frozen=True)
class DrawingKind:
    """A kind of points: what it is, in words; its colour, and how large a point is drawn where few
    are missed, as a share of the target's diagonal."""

    number: int
    words: str
    colour: str
    size: float


KINDS = (
    DrawingKind(UNSEEN, "not seen", UNSEEN_COLOUR, 0.0054),
    DrawingKind(SHADOWED, "shadowed: in a cone, but something is in the way", "#000000", 0.0054),
    DrawingKind(ONCE, "seen by one sensor", "#56B4E9", 0.0029),
    DrawingKind(TWICE, "seen by two or more", "#0072B2", 0.0029),
)
# no blues: those are of points
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
    """The colour of each link's rings and beams."""
    return dict(zip(links, cycle(_LINKS), strict=False))
