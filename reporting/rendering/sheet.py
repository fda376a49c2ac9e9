"""A sheet of paper in front of an eye: flat polygons of a solid scene, painted from far to near,
and the file they go to.

matplotlib's 3D axes do not sort by depth across artists. So every view is painted by hand: solids
become polygons, a camera projects them, and one collection draws them all.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PolyCollection
from matplotlib.colors import to_rgb, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from ...formats.escaping import printable_lines
from ...formats.writing import write_bytes

# Okabe and Ito's colours, told apart by every kind of colour vision: cool ones see, the hot one is
# unseen.
LINK_COLOURS = ("#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#F0E442")
UNSEEN_COLOUR = "#D55E00"
CLEAR = (0.0, 0.0, 0.0, 0.0)


class Sheet:
    """What an eye sees of ``box`` (2, 3) m, lower and upper corner: polygons, painted on ``ax``
    from far to near.
    """

    def __init__(
        self,
        ax: Axes,
        box: Any,
        azimuth_deg: float,
        elevation_deg: float,
        diagonals: float = np.inf,
    ) -> None:
        """Look at the middle of ``box`` from a distance of so many of its diagonals; from infinity,
        edges that are parallel stay so."""
        (sa, ca), (se, ce) = (
            (np.sin(np.radians(v)), np.cos(np.radians(v))) for v in (azimuth_deg, elevation_deg)
        )
        right, up, towards_eye = (-sa, ca, 0.0), (-se * ca, -se * sa, ce), (ce * ca, ce * sa, se)
        self.ax, self.box, self.rotation = ax, box, np.array([right, up, towards_eye])
        self.size = float(np.linalg.norm(box[1] - box[0]))
        self.distance = diagonals * self.size
        # depths, outlines, faces' colours, edges', edges' widths
        self._batches: list[tuple[Any, ...]] = []

    def project(self, points: Any) -> tuple[Any, Any]:
        """Picture coordinates (..., 2), m at the box's middle, and depths (...), larger is nearer,
        of points (..., 3).
        """
        seen = (points - self.box.mean(axis=0)) @ self.rotation.T
        nearness = (
            self.distance / (self.distance - seen[..., 2:]) if np.isfinite(self.distance) else 1.0
        )
        return seen[..., :2] * nearness, seen[..., 2]

    def lit(self, colour: Any, normal: Any) -> Any:
        """Colours (N, 3) of surfaces with unit normals (N, 3), lit from the upper left behind the
        eye; both sides alike.

        Args:
            colour: of all, by name or (3,), or of each (N, 3), in [0, 1].
        """
        seen = normal @ self.rotation.T
        light = np.clip(np.where(seen[:, 2:] < 0, -1, 1) * (seen @ [[-0.45], [0.6], [0.66]]), 0, 1)
        rgb = np.array(to_rgb(colour)) if isinstance(colour, str) else np.asarray(colour)
        return np.clip(rgb * (0.5 + 0.5 * light) + 0.25 * light**6, 0, 1)

    def add(
        self, depths: Any, outlines: Any, face: Any, edge: Any = CLEAR, width: float = 0.0
    ) -> None:
        """Add polygons: depths (N,), outlines (N, M, 2) m on the sheet, colours of their faces and
        edges, of all or of each (N, 3 or 4), and the edges' width in points."""
        colours = (np.broadcast_to(to_rgba_array(c), (len(depths), 4)) for c in (face, edge))
        self._batches.append(
            (np.asarray(depths), np.asarray(outlines), *colours, np.full(len(depths), width))
        )

    def surface(self, faces: Any, colour: Any, alpha: float = 1.0, edges: bool = True) -> None:
        """Add flat faces (N, M, 3) m, lit; ``colour`` of all, or (N, 3) of each. ``edges`` closes
        the seams between opaque faces that are painted smoothed."""
        normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        rgb = self.lit(
            colour, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        )
        rgba = np.column_stack([rgb, np.full(len(rgb), alpha)])
        outlines, depths = self.project(faces)
        self.add(
            depths.mean(axis=1), outlines, rgba, rgba if edges else CLEAR, 0.4 if edges else 0.0
        )

    def paint(self, smooth: bool = True, fit: bool = False, zorder: float = 2) -> Collection:
        """Draw what was added so far, what is as deep in the order it was added, and forget it.

        ``smooth``: blend the edges of every polygon. Without, no seam shows between neighbours,
        even translucent ones, and a file of finer pixels smooths the picture as a whole (see
        ``write_png``). ``fit``: the axes' limits grow to it.
        """
        depths, outlines, faces, edges, widths = zip(*self._batches, strict=True)
        order = np.argsort(np.concatenate(depths), kind="stable")
        if len({xy.shape[1] for xy in outlines}) == 1:
            shapes: Any = np.concatenate(outlines)[order]
        else:
            each = [xy for batch in outlines for xy in batch]
            shapes = [each[i] for i in order]
        face, edge, width = (np.concatenate(v)[order] for v in (faces, edges, widths))
        painted = PolyCollection(
            shapes,
            facecolors=face,
            edgecolors=edge,
            linewidths=width,
            antialiaseds=smooth,
            zorder=zorder,
        )
        self._batches = []
        corners = np.concatenate([xy.reshape(-1, 2) for xy in outlines])
        if fit and len(corners):
            self.ax.update_datalim([corners.min(axis=0), corners.max(axis=0)])
        return self.ax.add_collection(painted, autolim=False)


def write_png(path: Path, figure: Figure, finer: int = 1) -> None:
    """Write the figure as a PNG: the old file or the new, never half.

    Args:
        finer: pixels a side that are drawn for one in the file, which is their mean.

    Raises:
        UserError: if the file cannot be written; an old one stays as it was.
    """
    dpi = figure.dpi
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a dollar in a name is a dollar
        text.set_text(printable_lines(text.get_text()))
    figure.set_dpi(finer * dpi)
    canvas, data = FigureCanvasAgg(figure), io.BytesIO()
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]).reduce(finer)
    figure.set_dpi(dpi)
    pixels = np.asarray(image) // 5 * 5  # 52 steps of a channel, half the file; white stays white
    Image.fromarray(pixels).save(data, "png", optimize=True)
    write_bytes(path, data.getvalue())
