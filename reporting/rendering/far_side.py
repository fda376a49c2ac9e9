"""The far side of a solid, as an image with depth shading: a bowl around what stands in it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.path import Path as Outline
from scipy.ndimage import distance_transform_edt
from scipy.spatial import ConvexHull, QhullError

from .canvas import Canvas

_ACROSS = 192  # pixels along the longer side
_LIGHT = 0.4  # weight of the shading; the rest is the plain colour


def add_far_side(
    canvas: Canvas,
    pieces: Sequence[Float[np.ndarray, "_ 3"]],
    hulls: Sequence[Float[np.ndarray, "_ 2"]],
    colours: Callable[[Any], Any],
    zorder: float,
) -> None:
    """Draw the side of a solid that is farther from the eye, seen from within.

    Args:
        canvas: the view.
        pieces: corners (N, 3) m of the convex pieces of which the solid is the union.
        hulls: outline (M, 2) m of each piece in the axes; see ``Canvas.hull``.
        colours: function of points (P, 3) m on the surface that returns their colours (P, 3).
        zorder: order among the parts of the axes.
    """
    every = np.concatenate(hulls)
    low, high = every.min(axis=0), every.max(axis=0)
    pixel = float((high - low).max()) / _ACROSS
    wide, tall = (np.ceil((high - low) / pixel).astype(int) + 1).tolist()
    xy = low + pixel * (np.indices((tall, wide))[::-1].reshape(2, -1).T + 0.5)
    depth, normal = _farthest(canvas, pieces, hulls, xy)
    hit = np.isfinite(depth)
    if not hit.any():
        return
    plain = colours(canvas.unproject(xy[hit], depth[hit]))
    flat = np.ones((len(xy), 3))
    flat[hit] = (1 - _LIGHT) * plain + _LIGHT * canvas.lit(plain, normal[hit])
    image = flat.reshape(tall, wide, 3)
    nearest = distance_transform_edt(
        ~hit.reshape(tall, wide), return_distances=False, return_indices=True
    )
    limits = canvas.ax.get_xlim(), canvas.ax.get_ylim(), canvas.ax.dataLim.frozen()
    extent = (low[0], low[0] + wide * pixel, low[1], low[1] + tall * pixel)
    shown = canvas.ax.imshow(
        image[tuple(nearest)],
        extent=extent,
        origin="lower",
        interpolation="bilinear",
        zorder=zorder,
        aspect="equal",
    )
    canvas.ax.set(xlim=limits[0], ylim=limits[1])
    canvas.ax.dataLim.set(limits[2])
    canvas.ax.autoscale(True)
    union = Outline.make_compound_path(*(Outline([*hull, hull[0]], closed=True) for hull in hulls))
    shown.set_clip_path(union, canvas.ax.transData)


def _farthest(
    canvas: Canvas,
    pieces: Sequence[Float[np.ndarray, "_ 3"]],
    hulls: Sequence[Float[np.ndarray, "_ 2"]],
    xy: Float[np.ndarray, "P 2"],
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, "P 3"]]:
    """Return the depth (P,) m at which each ray leaves the solid for good, infinite where it
    misses it, and the unit normal (P, 3) there."""
    depth, normal = np.full(len(xy), np.inf), np.zeros((len(xy), 3))
    way = canvas.unproject(xy, -np.ones(len(xy))) - canvas.unproject(xy, np.zeros(len(xy)))
    way = way.astype(np.float32)  # away from the eye, of depth 1
    reach = [np.sort(canvas.project(piece)[1])[[0, -1]] for piece in pieces]
    # the farthest first: a ray that leaves one of them behind a nearer piece needs no look at that
    for k in sorted(range(len(pieces)), key=lambda k: reach[k][0]):
        piece, hull, (back, front) = pieces[k], hulls[k], reach[k]
        about = ((xy >= hull.min(axis=0)) & (xy <= hull.max(axis=0))).all(axis=1)
        rays = np.flatnonzero(about & (depth > back))
        rays = rays[Outline(hull).contains_points(xy[rays])]
        if not len(rays):
            continue
        try:
            sides = ConvexHull(piece).equations
        except QhullError:  # a piece without volume
            continue
        planes = np.unique(np.round(sides, 6), axis=0).astype(np.float32)
        ends = way[rays[[0, len(rays) // 2, -1]]]
        planes = planes[(ends @ planes[:, :3].T > -0.05).any(axis=0)]  # (F, 4), on the far side
        start = canvas.unproject(xy[rays], np.full(len(rays), front)).astype(np.float32)
        gap = np.maximum(-(start @ planes[:, :3].T + planes[:, 3]), 1e-6)  # (R, F), to each plane
        pace = way[rays] @ planes[:, :3].T / gap  # reciprocal of the depth from the front to it
        last = pace.argmax(axis=1)
        leave = front - 1 / pace[np.arange(len(rays)), last].astype(float)
        better = leave < depth[rays]
        chosen = rays[better]
        depth[chosen], normal[chosen] = leave[better], planes[last[better], :3]
    return depth, normal
