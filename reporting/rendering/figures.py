"""Figures that contain rendered pictures: scales, axes, and the output file."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from ...coverage.definitions.escaping import printable_lines
from ...formats.writing import write_bytes
from ..plots import INK
from .canvas import Canvas


def png(figure: Figure) -> bytes:
    """Return the figure as a PNG, with texts shown verbatim in printable characters."""
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # show a dollar sign in a name verbatim
        text.set_text(printable_lines(text.get_text()))
    canvas, data = FigureCanvasAgg(figure), io.BytesIO()
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    pixels = pixels // 5 * 5  # 52 levels a channel halve the file; white stays white
    # level 7 takes twice as long for a twentieth less, level 9 eight times
    Image.fromarray(pixels).save(data, "png", compress_level=4)
    return data.getvalue()


def write_png(path: Path, figure: Figure) -> None:
    """Write the figure as PNG atomically.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    write_bytes(path, png(figure))


def add_bar(canvas: Canvas, at: tuple[float, float], length: float) -> None:
    """Draw a scale bar of ``length`` m whose left end is ``at`` (x, y) m on the canvas."""
    x, y = np.array(at)[:, None] + length * np.array(
        [(0, 0, 0, 1, 1, 1), (0.02, -0.02, 0, 0, 0.02, -0.02)]
    )
    canvas.ax.plot(x, y, color=INK, lw=1.1, zorder=5)
    below: dict[str, Any] = {
        "xytext": (0, -5),
        "textcoords": "offset points",
        "ha": "center",
        "va": "top",
    }
    canvas.ax.annotate(f"{length:g} m", (x.mean(), at[1]), color=INK, fontsize=9, zorder=5, **below)


def add_base_axes(canvas: Canvas, length: float) -> None:
    """Draw the axes of the base, ``length`` m, from its origin, with their names; one that points
    at the eye is left out."""
    start = canvas.project(np.zeros(3))[0]
    arrow = {"arrowstyle": "-|>", "color": INK, "lw": 1.1, "shrinkA": 0, "shrinkB": 0}
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 10, "color": INK}
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        end = canvas.project(length * axis)[0]
        if np.linalg.norm(end - start) > 0.2 * length:
            canvas.ax.annotate("", end, start, arrowprops=arrow, zorder=5)
            canvas.ax.text(*(start + 1.14 * (end - start)), name, zorder=5, **style)
