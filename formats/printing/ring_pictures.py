"""Pictures of printed rings: each with its dimensions, and one as it is mounted."""

import io
import math

import matplotlib
import numpy as np
from jaxtyping import Float
from manifold3d import Manifold
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from ..escaping import printable_lines
from ..schema.print_models import PrintedRing
from .depth_buffer import frame_of, looking, render
from .primitives import union
from .print_plan import PrintPlan
from .ring_solids import Assembly

_BODY, _OTHER = (0.93, 0.62, 0.28), (0.98, 0.76, 0.46)
_BOARD, _METAL, _LINK = (0.16, 0.52, 0.38), (0.62, 0.64, 0.68), (0.80, 0.83, 0.88)
_INK = "#333333"
_APART = 14.0  # mm, between the halves where they are shown apart
_ABOVE = looking(90, -90)
_SIDE = looking(0, -90)
Window = tuple[float, float, float, float]
Parts = list[tuple[Manifold, tuple[float, float, float]]]


def _show(
    ax: Axes, parts: Parts, view: Float[np.ndarray, "3 3"], margin: float, width: int
) -> Window:
    window = frame_of(parts, view, margin)
    ax.imshow(render(parts, view, window, width), extent=window, interpolation="antialiased")
    ax.set_xlim(window[0], window[1])
    ax.set_ylim(window[2], window[3])
    ax.set_aspect("equal")
    ax.axis("off")
    return window


def _dimension(
    ax: Axes,
    a: tuple[float, float],
    b: tuple[float, float],
    text: str,
    off: tuple[float, float] = (0, 0),
) -> None:
    """An arrow between two points, and what it measures."""
    ax.annotate(
        "",
        a,
        b,
        arrowprops={"arrowstyle": "<|-|>", "color": _INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    middle = ((a[0] + b[0]) / 2 + off[0], (a[1] + b[1]) / 2 + off[1])
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.9}
    ax.text(*middle, text, ha="center", va="center", fontsize=9, color=_INK, bbox=box)


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a dollar in a link's name is a dollar
        text.set_text(printable_lines(text.get_text()))
    with matplotlib.rc_context({"svg.hashsalt": "place-rings"}):
        FigureCanvasAgg(figure).print_png(out, metadata={"Software": None})
    return out.getvalue()


def ring_picture(plan: PrintPlan, made: Assembly, record: PrintedRing) -> bytes:
    """A PNG of a ring: both halves apart as printed, from above and from the side with dimensions,
    and what was measured.
    """
    figure = Figure(figsize=(13, 8.2), dpi=100, facecolor="white")
    one, other = made.halves
    apart: Parts = [
        (one.translate((0, _APART / 2, 0)), _BODY),
        (other.translate((0, -_APART / 2, 0)), _OTHER),
    ]
    _show(figure.add_axes((0.01, 0.40, 0.56, 0.53)), apart, looking(38, -62), 3, 640)
    parts: Parts = [(one, _BODY), (other, _OTHER)]
    above = figure.add_axes((0.57, 0.36, 0.43, 0.57))
    left, right, bottom, _ = _show(above, parts, _ABOVE, 14, 440)
    x, y = (float(v) for v in plan.centre)
    low = bottom + 6
    _dimension(above, (left + 14, low), (right - 14, low), f"{right - left - 28:.1f} mm")
    slant = math.radians(52)
    for radius, at, label in ((plan.bore, (x, y), "bore"), (plan.radius, (0.0, 0.0), "lenses")):
        tip = (at[0] + radius * math.cos(slant), at[1] + radius * math.sin(slant))
        tail = (at[0] - radius * math.cos(slant), at[1] - radius * math.sin(slant))
        shift = (
            (0.0, 0.0)
            if label == "bore"
            else (0.62 * radius * math.cos(slant), 0.62 * radius * math.sin(slant))
        )
        _dimension(above, tail, tip, f"{label} ⌀ {2 * radius:.1f}", shift)
        slant = math.radians(-38)
    side = figure.add_axes((0.57, 0.02, 0.43, 0.30))
    window = _show(side, parts, _SIDE, 12, 480)
    _dimension(
        side,
        (window[1] - 10, plan.low),
        (window[1] - 10, plan.lug[1]),
        f"{plan.lug[1] - plan.low:.1f}",
    )
    side.axhline(plan.low, color=_INK, lw=0.8, ls=(0, (6, 3)))
    side.text(window[0] + 1, plan.low - 2, "bed", fontsize=9, color=_INK, va="top")
    lines = [
        (
            f"{record.count} boards, tilted by {abs(record.tilt_deg):.1f}°,"
            f" {record.position_mm:.1f} mm along {record.link}"
        ),
        f"screws {record.screws}; bolts {record.bolts}",
        "",
        *(
            f"{'✓' if c.holds else '✗'} {c.name}: {c.measured:.4g}"
            f" {c.unit}{_allowed(c.least, c.most)}"
            for c in record.checks
        ),
    ]
    figure.text(0.02, 0.37, "\n".join(lines), fontsize=9.5, va="top", color=_INK, linespacing=1.35)
    figure.suptitle(f"Ring {record.ring} on {record.link}", x=0.02, ha="left", fontsize=14)
    return _png(figure)


def _allowed(least: float | None, most: float | None) -> str:
    if least is not None:
        return f" (at least {least:.3g})"
    return "" if most is None else f" (at most {most:.3g})"


def assembled_picture(plan: PrintPlan, made: Assembly, record: PrintedRing) -> bytes:
    """A PNG of a ring with boards and bolts around its link, from two sides; arrows say where the
    sensors look.
    """
    figure = Figure(figsize=(13, 6.6), dpi=100, facecolor="white")
    reach = 0.35 * plan.radius
    middle = (plan.low + plan.lug[1]) / 2
    span = 0.85 * plan.radius
    link = made.link.trim_by_plane((0, 0, 1), middle - span).trim_by_plane(
        (0, 0, -1), -middle - span
    )
    parts: Parts = [*zip(made.halves, (_BODY, _OTHER), strict=True)]
    parts += [(union(made.boards), _BOARD), (made.bolts, _METAL), (link, _LINK)]
    for place, view in (
        ((0.0, 0.02, 0.53, 0.9), looking(28, -58)),
        ((0.5, 0.02, 0.5, 0.9), looking(62, -90)),
    ):
        ax = figure.add_axes(place)
        _show(ax, parts, view, 0.3 * plan.radius, 600)
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
    return _png(figure)
