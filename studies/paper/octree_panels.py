"""Panels of the octree pictures: axes, titles, and one scale for all."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...reporting.plots import GREY, INK
from ...reporting.rendering.canvas import Canvas
from ...reporting.rendering.figures import add_axes, add_bar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DPI = 150


def panel_axes(
    size: tuple[float, float], rows: int, columns: int, **space: float
) -> "tuple[Figure, list[Axes]]":
    """Return a figure of ``size`` inches and its axes, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=_DPI, facecolor="white")
    axes = figure.subplots(rows, columns, squeeze=False, gridspec_kw=space)
    for ax in axes.flat:
        ax.axis("off")
    return figure, list(axes.flat)


def add_head(figure: "Figure", title: str, text: str) -> None:
    """Write a title, and a text below it, above all panels."""
    height = figure.get_size_inches()[1]
    figure.text(
        0.5, 1 - 0.2 / height, title, fontsize=15, color=INK, weight="bold", ha="center", va="top"
    )
    figure.text(0.5, 1 - 0.52 / height, text, fontsize=10.5, color=GREY, ha="center", va="top")


def add_title(ax: "Axes", name: str, text: str) -> None:
    """Write the name of a panel, and a text below it, above the panel."""
    for words, up, size, colour, weight in (
        (text, 3, 9.5, GREY, "normal"),
        (name, 3 + 11.8 * (1 + text.count("\n")), 12, INK, "bold"),
    ):
        place: dict[str, Any] = {
            "xycoords": "axes fraction",
            "xytext": (0, up),
            "textcoords": "offset points",
            "va": "bottom",
        }
        ax.annotate(words, (0, 1), fontsize=size, color=colour, weight=weight, **place)


def fit_panels(canvases: Sequence[Canvas], alike: bool) -> None:
    """Zoom to the drawings, equally on all canvases if ``alike``, and draw scales and axes
    below.
    """
    limits = np.array([(s.ax.dataLim.min, s.ax.dataLim.max) for s in canvases])
    if alike:
        limits[:] = limits[:, 0].min(axis=0), limits[:, 1].max(axis=0)
    for i, (canvas, (low, high)) in enumerate(zip(canvases, limits, strict=True)):
        figure: Any = canvas.ax.figure
        cell = figure.get_size_inches() * canvas.ax.get_position(original=True).size
        middle, size = (low + high) / 2, (high - low) * [1, 1.15]
        size = cell * (size / cell).max()
        (left, bottom), (right, top) = middle - size * [0.5, 0.545], middle + size * [0.5, 0.455]
        canvas.ax.set(xlim=(left, right), ylim=(bottom, top))
        if i == 0 or not alike:
            add_bar(canvas, (left + 0.01 * size[0], bottom + 0.06 * size[1]), 0.5)
        if i == 0:
            add_axes(canvas, (right - 0.11 * size[1], bottom + 0.05 * size[1]), 0.07 * size[1])
