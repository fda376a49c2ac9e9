"""Matplotlib artist that renders a canvas when the figure is drawn, pixel for pixel."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.artist import Artist


class RenderedCanvas(Artist):
    """Picture of a canvas at the final resolution and limits of the axes."""

    def __init__(
        self, image: Callable[..., Any], extent: Any, zorder: float, finer: int, outline: float
    ) -> None:
        """Keep what is needed to render later.

        Args:
            image: ``Canvas.image``, or a function like it.
            extent: lower and upper corner (2, 2) m of the picture.
            zorder: order among the artists of the axes.
            finer: see ``Canvas.image``.
            outline: see ``Canvas.image``.
        """
        super().__init__()
        self._image, self._extent, self._how = image, extent, (finer, outline)
        self.set_zorder(zorder)
        self.set_in_layout(False)

    def draw(self, renderer: Any) -> None:
        """Render the part inside the axes."""
        axes: Any = self.axes
        frame = np.array(axes.bbox.extents).reshape(2, 2)
        to_screen = axes.transData
        low, high = to_screen.transform(self._extent)
        low = np.floor(np.maximum(low - 2, frame[0])).astype(int)
        high = np.ceil(np.minimum(high + 2, frame[1])).astype(int)
        columns, rows = (int(n) for n in high - low)
        if not self.get_visible() or columns < 1 or rows < 1:
            return
        corners = to_screen.inverted().transform([low, high])
        pixel = (corners[1] - corners[0]) / (columns, rows)
        finer, outline = self._how
        image = self._image(
            corners[0], pixel, (rows, columns), finer, outline, renderer.points_to_pixels(1.0)
        )
        gc = renderer.new_gc()
        gc.set_clip_rectangle(axes.bbox)
        renderer.draw_image(gc, int(low[0]), int(low[1]), (255 * image + 0.5).astype(np.uint8))
        gc.restore()
        self.stale = False
