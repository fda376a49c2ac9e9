"""Colours that the viewer, the pictures and exported scenes share, as ``#rrggbb``.

Okabe and Ito (2008): distinguishable with every kind of colour vision. Cool colours are covered,
the hot one is uncovered; links have no blues, because covered points use them.
"""

from collections.abc import Sequence
from itertools import cycle

UNCOVERED, SHADOWED, COVERED_ONCE, COVERED_TWICE = "#D55E00", "#000000", "#56B4E9", "#0072B2"
ROBOT, OBSTACLE, SENSOR, CELL = "#b4bbc3", "#c9b48c", "#23272b", "#6b7a8f"
WARNING = "#d33a4e"  # what cannot be built or is not as it should be; a text says why
_LINKS = ("#009E73", "#CC79A7", "#F0E442", "#7A5230", "#999999", "#E69F00")


def link_colours(links: Sequence[str]) -> dict[str, str]:
    """Return the colour of each link's rings and beams."""
    return dict(zip(links, cycle(_LINKS), strict=False))


def rgb(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue of a colour, 0 to 1."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue
