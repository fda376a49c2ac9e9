"""Style of the plots: colours, sizes, axes."""

import io
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from ..coverage.definitions.escaping import printable_lines
from ..formats.writing import write_bytes

INK, GREY, GRID = "#23272b", "#666d75", "#d9dde1"
# Okabe and Ito's colours, distinguishable with every kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#23272b")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def sheet(width: float, height: float) -> Figure:
    """Return an empty figure of ``width`` by ``height`` inches that needs no display."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plain(ax: Axes, title: str = "", x: str = "", y: str = "") -> None:
    """Style axes with a grid behind the data, no frame above and on the right, and the title on the
    left.
    """
    ax.set_axisbelow(True)
    ax.grid(True, which="major", color=GRID, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(title, fontsize=10.5, loc="left", color=INK)
    ax.set_xlabel(x)
    ax.set_ylabel(y)


def lying(ax: Axes, places: Sequence[float], names: Sequence[str], x: str) -> None:
    """Style axes of lying bars or marks: a name at each place, and a grid across them."""
    ax.set_yticks(places, names, fontsize=9)
    ax.set_axisbelow(True)
    ax.grid(True, axis="x", color="#e5e8eb", lw=0.6)
    ax.spines[["top", "right", "left"]].set_visible(False)
    ax.tick_params(axis="y", length=0, colors=INK)
    ax.tick_params(axis="x", labelsize=8.5, colors=GREY)
    ax.set_xlabel(x, fontsize=9, color=GREY)


def save(figure: Figure, file: Path) -> None:
    """Write the figure as PNG atomically.

    Raises:
        UserError: if the file cannot be written.
    """
    for text in figure.findobj(Text):
        text.set_text(printable_lines(text.get_text()))
    data = io.BytesIO()
    figure.savefig(data, dpi=120, format="png")
    write_bytes(file, _smaller(Image.open(data)))


def _smaller(image: Image.Image) -> bytes:
    """Return an image as a PNG of 256 colours.

    Plots look the same, because this method keeps every colour within about a tenth of a channel's
    range, and have a third of the size.
    """
    few = image.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    data = io.BytesIO()
    few.save(data, "png", optimize=True)
    return data.getvalue()
