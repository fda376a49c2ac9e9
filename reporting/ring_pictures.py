"""Pictures of printed rings: each ring with its dimensions, and one ring mounted."""

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..formats.printing.lids import flat_lid
from ..formats.printing.primitives import union
from ..formats.printing.print_files import MOUNTED
from ..formats.printing.print_plan import PrintPlan
from ..formats.printing.ring_solids import Assembly
from ..formats.schema.print_models import PrintedLids, PrintedRing
from .rendering.canvas import Canvas
from .rendering.figures import png

if TYPE_CHECKING:
    from manifold3d import Manifold

_BODY, _OTHER, _THIRD = (0.93, 0.62, 0.28), (0.98, 0.76, 0.46), (0.80, 0.48, 0.20)
_BOARD, _METAL, _LINK = (0.16, 0.52, 0.38), (0.62, 0.64, 0.68), (0.80, 0.83, 0.88)
_LID = (0.36, 0.47, 0.62)
_INK = "#333333"
_APART = 14.0  # mm, gap between the parts in the exploded view
_PAGE, _STRIP = 8.2, 2.2  # inches, height of a ring's picture, and of the strip for lids below
_STEP = 1.2  # mm, step in depth between neighbouring pixels that gets an outline
_CREASE = 30.0  # degrees, angle between faces that makes a sharp edge
_ABOVE, _SIDE = (-90, 90), (-90, 0)  # azimuth and elevation of the eye, degrees
_ABOUT_ORIGIN = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
Place = tuple[float, float, float, float]
Parts = list[tuple["Manifold", tuple[float, float, float]]]


def _show(ax: Axes, parts: Parts, eye: tuple[float, float], margin: float) -> Canvas:
    """Draw solids in their colours; the coordinates of the axes are mm from the origin."""
    canvas = Canvas(ax, _ABOUT_ORIGIN, *eye)
    for solid, colour in parts:
        mesh = solid.calculate_normals(0, _CREASE).to_mesh()
        canvas.mesh((mesh.vert_properties[:, :3], mesh.tri_verts), colour, closed=True)
    extent: Any = canvas.extent()
    low, high = extent + np.array([[-margin], [margin]])
    canvas.draw(fit=False, outline=_STEP)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.axis("off")
    return canvas


def _dimension(
    ax: Axes,
    a: tuple[float, float],
    b: tuple[float, float],
    text: str,
    off: tuple[float, float] = (0, 0),
) -> None:
    """Draw a dimension line between two points with its text."""
    ax.annotate(
        "",
        a,
        b,
        arrowprops={"arrowstyle": "<|-|>", "color": _INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    middle = ((a[0] + b[0]) / 2 + off[0], (a[1] + b[1]) / 2 + off[1])
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.9}
    ax.text(*middle, text, ha="center", va="center", fontsize=9, color=_INK, bbox=box)


def ring_picture(plan: PrintPlan, made: Assembly, record: PrintedRing) -> bytes:
    """Return a PNG of a ring: the exploded parts, views with dimensions, and measured values."""
    strip = _STRIP if made.lids else 0.0
    figure = Figure(figsize=(13, _PAGE + strip), dpi=100, facecolor="white")
    parts: Parts = [*zip(made.parts, itertools.cycle((_BODY, _OTHER)))]
    if len(parts) % 2:
        parts[-1] = (made.parts[-1], _THIRD)
    off, apart = _APART / 2 / math.sin(math.pi / len(parts)), Parts()
    for (part, colour), arc in zip(parts, plan.arcs, strict=True):
        way = sum(arc) / 2
        apart.append((part.translate((off * math.cos(way), off * math.sin(way), 0)), colour))
    _show(figure.add_axes(_above((0.01, 0.40, 0.56, 0.53), strip)), apart, (-62, 38), 3)
    above = figure.add_axes(_above((0.57, 0.36, 0.43, 0.57), strip))
    _show(above, parts, _ABOVE, 14)
    (left, right), (bottom, _) = above.get_xlim(), above.get_ylim()
    low = bottom + 6
    _dimension(above, (left + 14, low), (right - 14, low), f"{right - left - 28:.1f} mm")
    slant = math.radians(52)
    for radius, label in ((plan.bore, "bore"), (plan.radius, "lenses")):
        tip = (radius * math.cos(slant), radius * math.sin(slant))
        tail = (-tip[0], -tip[1])
        shift = (
            (0.0, 0.0)
            if label == "bore"
            else (0.62 * radius * math.cos(slant), 0.62 * radius * math.sin(slant))
        )
        _dimension(above, tail, tip, f"{label} ⌀ {2 * radius:.1f}", shift)
        slant = math.radians(-38)
    side = figure.add_axes(_above((0.57, 0.02, 0.43, 0.30), strip))
    _show(side, parts, _SIDE, 12)
    left, right = side.get_xlim()
    _dimension(
        side,
        (right - 10, plan.low),
        (right - 10, plan.lug[1]),
        f"{plan.lug[1] - plan.low:.1f}",
    )
    side.axhline(plan.low, color=_INK, lw=0.8, ls=(0, (6, 3)))
    side.text(left + 1, plan.low - 2, "bed", fontsize=9, color=_INK, va="top")
    _, low, _, _ = _above((0.0, 0.385, 0.0, 0.0), strip)
    text = "\n".join(_lines(record))
    figure.text(0.02, low, text, fontsize=8.6, va="top", color=_INK, linespacing=1.25)
    if record.lids:
        _draw_lid(figure, plan, record.lids)
    figure.suptitle(f"Ring {record.ring} on {record.link}", x=0.02, ha="left", fontsize=14)
    return png(figure)


def _above(place: Place, strip: float) -> Place:
    """Return a place (left, low, width, height) on a page, as shares of the page with a strip of
    ``strip`` inches below it."""
    left, low, width, height = place
    whole = _PAGE + strip
    return left, (low * _PAGE + strip) / whole, width, height * _PAGE / whole


def _lines(record: PrintedRing) -> list[str]:
    """Return the lines of text on the picture of a ring."""
    return [
        (
            f"{record.count} boards, tilted by {abs(record.tilt_deg):.1f}°,"
            f" {record.position_mm:.1f} mm along {record.link}"
        ),
        f"screws {record.screws}; bolts {record.bolts.partition(' (')[0]}",
        f"lettering {', '.join(record.lettering) or 'none'}; cable ties {record.ties}",
        "",
        *(
            f"{'✓' if c.holds else '✗'} {c.name}: {c.measured:.4g}"
            f" {c.unit}{_allowed(c.least, c.most)}"
            for c in record.checks
        ),
    ]


def _draw_lid(figure: Figure, plan: PrintPlan, lids: PrintedLids) -> None:
    """Draw a lid as it is printed, and from its front, in the strip below a ring."""
    lid = flat_lid(plan)
    x0, y0, z0, x1, y1, z1 = lid.bounding_box()
    turned = lid.rotate((180.0, 0.0, 0.0)).translate((1.25 * (x1 - x0), y0 + y1, z0 + z1))
    ax = figure.add_axes((0.57, 0.0, 0.43, (_STRIP - 0.3) / (_PAGE + _STRIP)))
    _show(ax, [(lid, _LID), (turned, _LID)], (-62, 42), 2)
    size = " × ".join(f"{v:.1f}" for v in lids.size_mm)
    ax.set_title(
        f"lid, as printed and from its front: {lids.copies} copies of {size} mm", fontsize=9
    )


def _allowed(least: float | None, most: float | None) -> str:
    if least is not None:
        return f" (at least {least:.3g})"
    return "" if most is None else f" (at most {most:.3g})"


def mounted_picture(plan: PrintPlan, made: Assembly, record: PrintedRing) -> bytes:
    """Return a PNG of a ring with boards, lids and bolts around its link, from two sides.

    Arrows show the directions of the sensors.
    """
    figure = Figure(figsize=(13, 6.6), dpi=100, facecolor="white")
    reach = 0.35 * plan.radius
    middle = (plan.low + plan.lug[1]) / 2
    span = 0.85 * plan.radius
    link = made.link.trim_by_plane((0, 0, 1), middle - span).trim_by_plane(
        (0, 0, -1), -middle - span
    )
    parts: Parts = [*zip(made.parts, itertools.cycle((_BODY, _OTHER)))]
    parts += [(union(made.boards), _BOARD), (made.bolts, _METAL), (link, _LINK)]
    parts += [(union(made.lids), _LID), (union(made.heads), _METAL)] if made.lids else []
    for place, eye in (
        ((0.0, 0.02, 0.53, 0.9), (-58, 28)),
        ((0.5, 0.02, 0.5, 0.9), (-90, 62)),
    ):
        ax = figure.add_axes(place)
        view = _show(ax, parts, eye, 0.3 * plan.radius).rotation
        for k in range(len(plan.angles)):
            frame = plan.frame(k)
            if float(frame[:, 2] @ view[2]) > 0.1:
                start, end = (view[:2] @ (frame[:, 3] + d * frame[:, 2]) for d in (2.0, reach))
                ax.annotate(
                    "",
                    tuple(end),
                    tuple(start),
                    arrowprops={"arrowstyle": "-|>", "color": "#b03060", "lw": 1.1},
                )
    flipped = "towards proximal" if record.flipped else "towards distal"
    figure.suptitle(
        f"Ring {record.ring} on {record.link}, up: {flipped}", x=0.02, ha="left", fontsize=14
    )
    return png(figure)


def ring_pictures(plan: PrintPlan, made: Assembly, record: PrintedRing) -> dict[str, bytes]:
    """Return the pictures of a ring by file name, with a mounted view for the first ring."""
    own = {record.files[-1]: ring_picture(plan, made, record)}
    return own if record.ring else own | {MOUNTED: mounted_picture(plan, made, record)}
