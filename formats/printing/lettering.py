"""Lettering engraved in the outside of a ring's band: number and letter of the part, its link, and
an arrow to the wrist. Millimetres, print frame."""

import math
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from manifold3d import CrossSection, FillRule, JoinType, Manifold

from .primitives import union
from .print_plan import MM, PrintPlan

DEPTH = 0.6
"""Depth of the letters, mm."""
_MARGIN = 1.5  # above and below the letters
_TALLEST, _SMALLEST = 7.0, 4.5  # height of a capital
_CAPITAL = 0.729  # height of a capital, in font sizes
_ADVANCE = 0.76  # distance between letters, in font sizes: their gaps are printable walls
_OUT = 1.5  # extent of the cut beyond the surface
_ARROW = "\0"


def part_label(label: str, part: int) -> str:
    """Return the text on a part: the label with the part's letter after its number."""
    number, _, link = label.partition(" ")
    plain = "".join(c if c.isascii() and c.isalnum() else " " for c in link.upper())
    return f"{number}{chr(ord('A') + part)} {' '.join(plain.split())}".strip()


def lettering(plan: PrintPlan, part: int, arc: tuple[float, float]) -> Manifold:
    """Return what is cut out of a part: its text and an arrow to the wrist, as large as fits.

    A link's name that is too long for the arc loses its last letters.

    Args:
        plan: the ring.
        part: number of the part.
        arc: first and last azimuth that are free for the text, rad.
    """
    text = part_label(plan.label, part) + " " + _ARROW
    length = (arc[1] - arc[0]) * plan.collar
    margin = max(_MARGIN, 1.2 * MM * plan.printing.least_wall)
    tall = min(plan.lug[1] - plan.lug[0] - 2 * margin, _TALLEST)
    if tall < _SMALLEST - 1e-9 or plan.collar - plan.bore - DEPTH < MM * plan.printing.least_wall:
        return Manifold()
    fits = length * _CAPITAL / _ADVANCE  # letters times their height
    if fits < 5 * _SMALLEST:  # not even number, letter and arrow
        return Manifold()
    if len(text) * _SMALLEST > fits:
        text = text[: int(fits / _SMALLEST) - 2].rstrip() + " " + _ARROW
    tall = min(tall, fits / len(text))
    step = _ADVANCE / _CAPITAL * tall / plan.collar
    middle, low = (arc[0] + arc[1]) / 2, (plan.lug[0] + plan.lug[1] - tall) / 2
    cuts = []
    for i, letter in enumerate(text):
        if letter == " ":
            continue
        flip = letter == _ARROW and plan.ring.tilt < 0
        flat = _glyph(letter, tall, MM * plan.printing.least_wall, flip)
        solid = flat.extrude(DEPTH + _OUT).rotate((90.0, 0.0, 90.0))  # x: outwards, y: rightwards
        solid = solid.translate((plan.collar - DEPTH, 0.0, low))
        at = middle + (i - (len(text) - 1) / 2) * step
        cuts.append(solid.rotate((0.0, 0.0, math.degrees(at))))
    return union(cuts)


@lru_cache(maxsize=64)
def _outline(letter: str) -> list[Float[np.ndarray, "P 2"]]:
    """Return the polygons of a letter whose capitals are 1 high, standing on y = 0."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties("DejaVu Sans Mono")  # it comes with matplotlib
    path = TextPath((0, 0), letter, size=100 / _CAPITAL, prop=font)
    return [np.asarray(polygon) / 100 for polygon in path.to_polygons()]


def _glyph(letter: str, tall: float, least: float, flip: bool) -> CrossSection:
    """Return a letter about x = 0, standing on y = 0; gaps narrower than ``least`` are closed."""
    if letter == _ARROW:
        w = tall / 3
        ends = [(-w, 0.45), (w, 0.45), (0, 1.0), (-0.12 * tall, 0.0), (0.12 * tall, 0.0)]
        (a, b, tip, c, d) = ((x, y * tall) for x, y in ends)
        shape = CrossSection.hull_points(np.array([a, b, tip])) + CrossSection.hull_points(
            np.array([c, d, (d[0], a[1] + 0.1), (c[0], a[1] + 0.1)])
        )
        return shape.mirror((0.0, 1.0)).translate((0.0, tall)) if flip else shape
    shape = CrossSection([tall * polygon for polygon in _outline(letter)], FillRule.EvenOdd)
    for by in (0.6 * least, -0.6 * least):
        shape = shape.offset(by, JoinType.Round, circular_segments=32)
    low_x, _, high_x, _ = shape.bounds()
    return shape.translate((-(low_x + high_x) / 2, 0.0))
