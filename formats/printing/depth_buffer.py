"""A shaded picture of solids by a depth buffer, in parallel projection: what is in front hides what
is behind, exactly.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from manifold3d import Manifold

_LIGHT = np.array([-0.35, 0.45, 0.82])  # to the viewer's left, above
_AMBIENT = 0.42
_BEHIND = -1e6  # mm, where nothing is
_EDGE = 1.2  # mm of depth between neighbouring pixels, from which on there is an outline


def looking(elevation_deg: float, azimuth_deg: float) -> Float[np.ndarray, "3 3"]:
    """Rows: to the right, up, and towards the viewer, of a view from above the horizon and about
    the vertical.
    """
    e, a = np.radians([elevation_deg, azimuth_deg])
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def render(
    parts: Sequence[tuple[Manifold, tuple[float, float, float]]],
    view: Float[np.ndarray, "3 3"],
    window: tuple[float, float, float, float],
    width: int,
) -> Float[np.ndarray, "H W 4"]:
    """The picture (H, W, 4) of solids in their colours, in a window (left, right, bottom, top) mm
    of the view, ``width`` pixels wide, row 0 at the top; where nothing is, it is transparent."""
    left, right, bottom, top = window
    scale = 2 * width / (right - left)  # of twice the pixels, which are joined by fours
    shape = 2 * round((top - bottom) * scale / 2), 2 * width
    depth, colour = np.full(shape, _BEHIND), np.zeros((*shape, 3))
    light = _LIGHT / np.linalg.norm(_LIGHT)
    for solid, tint in parts:
        mesh = solid.to_mesh()
        seen = mesh.vert_properties[:, :3] @ view.T
        corners = seen[mesh.tri_verts]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normal[:, 2] > 0
        unit = normal[facing] / np.linalg.norm(normal[facing], axis=1, keepdims=True)
        bright = _AMBIENT + (1 - _AMBIENT) * np.clip(unit @ light, 0.0, 1.0)
        flat = (corners[facing, :, :2] - (left, bottom)) * scale
        for xy, z, shade in zip(flat, corners[facing, :, 2], bright, strict=True):
            _fill(depth, colour, xy, z, shade * np.array(tint))
    drop = np.zeros(shape, bool)
    for axis in (0, 1):
        drop |= np.abs(depth - np.roll(depth, 1, axis)) > _EDGE + 2.0 / scale
    colour[drop] *= 0.35
    image = np.concatenate([colour, ((depth > _BEHIND) | drop)[..., None].astype(float)], axis=2)[
        ::-1
    ]
    fours = image.reshape(shape[0] // 2, 2, width, 2, 4)
    alpha = fours[..., 3:].sum(axis=(1, 3))
    mean = (fours[..., :3] * fours[..., 3:]).sum(axis=(1, 3)) / np.maximum(alpha, 1.0)
    halved: np.ndarray = np.clip(np.concatenate([mean, alpha / 4], axis=2), 0.0, 1.0)
    return halved


def _fill(
    depth: Float[np.ndarray, "H W"],
    colour: Float[np.ndarray, "H W 3"],
    xy: Float[np.ndarray, "3 2"],
    z: Float[np.ndarray, " 3"],
    tint: Float[np.ndarray, " 3"],
) -> None:
    """Fill a triangle whose corners lie anti-clockwise, where it is before what is there."""
    (x0, y0), (x1, y1), (x2, y2) = xy.tolist()
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if area < 1e-9:
        return
    rows, columns = (
        _span(min(y0, y1, y2), max(y0, y1, y2), depth.shape[0]),
        _span(min(x0, x1, x2), max(x0, x1, x2), depth.shape[1]),
    )
    if rows.stop <= rows.start or columns.stop <= columns.start:
        return
    y = np.arange(rows.start, rows.stop)[:, None] + 0.5
    x = np.arange(columns.start, columns.stop)[None, :] + 0.5
    a = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
    b = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
    c = 1.0 - a - b
    at = a * z[0] + b * z[1] + c * z[2]
    here = (a >= -1e-9) & (b >= -1e-9) & (c >= -1e-9) & (at > depth[rows, columns])
    depth[rows, columns][here] = at[here]
    colour[rows, columns][here] = tint


def _span(low: float, high: float, size: int) -> slice:
    return slice(max(int(np.floor(low)), 0), min(int(np.ceil(high)) + 1, size))


def frame_of(
    parts: Sequence[tuple[Manifold, tuple[float, float, float]]],
    view: Float[np.ndarray, "3 3"],
    margin: float,
) -> tuple[float, float, float, float]:
    """The window (left, right, bottom, top) mm that shows all of some solids, and a margin."""
    flat: Int[np.ndarray, "N 2"] = np.concatenate(
        [s.to_mesh().vert_properties[:, :3] @ view[:2].T for s, _ in parts]
    )
    (left, bottom), (right, top) = flat.min(axis=0) - margin, flat.max(axis=0) + margin
    return float(left), float(right), float(bottom), float(top)
