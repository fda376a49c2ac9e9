"""Triangles to pixels with a depth buffer, in NumPy: the part of the renderer that knows no camera.

Screen coordinates are pixels: x to the right, y up, the centre of the pixel in column i and row j
at (i + 1/2, j + 1/2). Depth grows towards the eye and is affine over a triangle. A pixel belongs to
a triangle when its centre lies inside; triangles that share an edge share no pixel and leave no
gap.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

_MOST = 3_000_000  # pixels of triangles that are handled at once, which bounds the memory
_DEPTH_BITS, _ITEM_BITS = 16, 24
UNLIT = -1.0


@dataclass(frozen=True)
class Triangles:
    """Triangles on the screen."""

    corners: Float[np.ndarray, "N 3 3"]
    """x and y in pixels, and depth, of each corner."""
    colour: Float[np.ndarray, "N 3"]
    """Red, green and blue in [0, 1]."""
    light: Float[np.ndarray, "N 3"]
    """Light at each corner in [0, 1], between which it is interpolated; ``UNLIT``: none to add."""
    alpha: Float[np.ndarray, " N"]
    """Opacity in [0, 1]."""

    def __len__(self) -> int:
        return len(self.alpha)

    @staticmethod
    def joined(parts: "list[Triangles]") -> "Triangles":
        """All triangles of several sets."""
        return Triangles(
            *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Triangles))
        )


def shaded(
    colour: Float[np.ndarray, "N 3"], light: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N 3"]:
    """Colours (N, 3) under light (N,): half ambient, half diffuse, and a highlight."""
    lit = np.clip(light, 0, 1)[:, None]
    square = lit * lit
    bright = colour * (0.5 + 0.5 * lit) + 0.25 * square * square * square
    return np.clip(np.where(light[:, None] < 0, colour, bright), 0, 1)


def _expand(count: Int[np.ndarray, " N"]) -> tuple[Int[np.ndarray, " M"], Int[np.ndarray, " M"]]:
    """Of runs of ``count`` (N,) elements: the run of each element, and its place in the run."""
    run = np.repeat(np.arange(len(count), dtype=np.int32), count)
    first = np.cumsum(count) - count
    return run, np.arange(len(run), dtype=np.int32) - first.astype(np.int32)[run]


def _planes(
    corners: Float[np.ndarray, "N 3 3"], value: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, "N 3"]:
    """Coefficients (N, 3) of 1, x and y of the affine function with ``value`` at the corners."""
    (x, y), base = np.moveaxis(corners[:, 1:, :2] - corners[:, :1, :2], 2, 0), corners[:, 0]
    area = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
    u, v = (value[:, 1:] - value[:, :1]).T
    across = (u * y[:, 1] - v * y[:, 0]) / area
    up = (v * x[:, 0] - u * x[:, 1]) / area
    return np.stack([value[:, 0] - across * base[:, 0] - up * base[:, 1], across, up], axis=1)


def _spans(
    corners: Float[np.ndarray, "N 3 3"], shape: tuple[int, int]
) -> tuple[
    Int[np.ndarray, " S"], Int[np.ndarray, " S"], Int[np.ndarray, " S"], Int[np.ndarray, " S"]
]:
    """The rows of pixels of triangles: triangle, row, first column and number of pixels of each."""
    order = np.argsort(corners[:, :, 1], axis=1, kind="stable")
    (xa, xb, xc), (ya, yb, yc) = (
        np.take_along_axis(corners[:, :, i], order, axis=1).T for i in (0, 1)
    )
    # from below to above, so that both triangles beside an edge get the same number
    long, lower, upper = (
        (x1 - x0) / np.where(y1 > y0, y1 - y0, 1.0)
        for x0, y0, x1, y1 in ((xa, ya, xc, yc), (xa, ya, xb, yb), (xb, yb, xc, yc))
    )
    first, last = (np.clip(np.ceil(y - 0.5), 0, shape[0]).astype(np.int32) for y in (ya, yc))
    which, place = _expand(np.maximum(last - first, 0))
    row = first[which] + place
    y = row + 0.5
    up = y - ya[which]
    one = xa[which] + up * long[which]
    below = y < yb[which]
    other = np.where(
        below, xa[which] + up * lower[which], xb[which] + (y - yb[which]) * upper[which]
    )
    left, right = (
        np.clip(np.ceil(f(one, other) - 0.5), 0, shape[1]).astype(np.int32)
        for f in (np.minimum, np.maximum)
    )
    some = right > left
    return which[some], row[some], left[some], (right - left)[some]


def _fragments(
    corners: Float[np.ndarray, "N 3 3"], shape: tuple[int, int]
) -> Iterator[tuple[Int[np.ndarray, " M"], Int[np.ndarray, " M"], Float[np.ndarray, " M"]]]:
    """All pixels of triangles in a picture of ``shape`` (rows, columns), part by part: the triangle
    of each, its pixel, row by row, and its depth there."""
    x, y = corners[:, 1:, 0] - corners[:, :1, 0], corners[:, 1:, 1] - corners[:, :1, 1]
    whole = np.flatnonzero(np.abs(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) > 1e-8)
    plane = _planes(corners[whole], corners[whole, :, 2])
    triangle, row, left, count = _spans(corners[whole], shape)
    total = np.cumsum(count)
    base, across, up = plane[triangle].T
    at = base + across * (left + 0.5) + up * (row + 0.5)
    start = 0
    while start < len(count):
        done = total[start - 1] if start else 0
        end = max(start + 1, int(np.searchsorted(total, done + _MOST)))
        part = slice(start, end)
        run, place = _expand(count[part])
        depth = at[part].astype(np.float32)[run]
        depth += across[part].astype(np.float32)[run] * place.astype(np.float32)
        pixel = (row[part] * np.int32(shape[1]) + left[part])[run] + place
        yield whole[triangle[part]].astype(np.int32)[run], pixel, depth
        start = end


class DepthBuffer:
    """A picture of rows by columns pixels: at each the nearest triangle, and before it translucent
    ones. Colours are multiplied by the opacity."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.shape = shape
        pixels = shape[0] * shape[1]
        self.depth = np.full(pixels, -np.inf, np.float32)
        self.colour = np.zeros((pixels, 3), np.float32)
        self.alpha = np.zeros(pixels, np.float32)

    def opaque(self, triangles: Triangles) -> None:
        """Draw triangles: at each pixel the nearest of them and of those before is seen, of equals
        the last."""
        nearest = np.full(len(self.depth), -1, np.int32)
        for triangle, pixel, depth in _fragments(triangles.corners, self.shape):
            won = self._nearer(pixel, depth)
            nearest[pixel[won]] = triangle[won]
        pixel = np.flatnonzero(nearest >= 0)
        mine = nearest[pixel]
        self.colour[pixel] = shaded(triangles.colour, triangles.light[:, 0]).astype(np.float32)[
            mine
        ]
        self.alpha[pixel] = 1.0
        bent = (triangles.light != triangles.light[:, :1]).any(axis=1)
        smooth = bent[mine]
        pixel, mine = pixel[smooth], mine[smooth]
        used = np.unique(mine)
        plane = _planes(triangles.corners[used], triangles.light[used])
        k = np.searchsorted(used, mine)
        y, x = np.divmod(pixel, self.shape[1])
        light = plane[k, 0] + plane[k, 1] * (x + 0.5) + plane[k, 2] * (y + 0.5)
        self.colour[pixel] = shaded(triangles.colour[mine], np.clip(light, 0, 1))

    def stamp(
        self,
        centre: Float[np.ndarray, "N 3"],
        radius: Float[np.ndarray, " N"],
        colour: Float[np.ndarray, "N 3"],
    ) -> None:
        """Draw round spots that face the eye: centres (N, 3), pixels and depth; radii, pixels.
        Those with a centre or a radius that is no number are left out.
        """
        sound = np.isfinite(centre).all(axis=1) & (radius >= 0)
        centre, radius, colour = centre[sound], radius[sound], colour[sound]
        high = np.array(self.shape[::-1])
        reach = np.ceil(radius.max(initial=0.0) + 0.5)
        size = np.minimum(2 * reach + 1, high).astype(int)  # of the windows that hold the spots
        first = np.clip(np.floor(centre[:, :2]) - reach, 0, high - size).astype(np.int32)
        step = max(_MOST // max(int(size.prod()), 1), 1)
        for start in range(0, len(centre), step):
            part = slice(start, start + step)
            self._stamp(centre[part], radius[part], colour[part], first[part], size)

    def _stamp(
        self,
        centre: Float[np.ndarray, "N 3"],
        radius: Float[np.ndarray, " N"],
        colour: Float[np.ndarray, "N 3"],
        first: Int[np.ndarray, "N 2"],
        size: Int[np.ndarray, " 2"],
    ) -> None:
        """Draw spots, each within a window of pixels: its first column and row, and its size."""
        with np.errstate(over="ignore"):  # beyond what float32 holds: far outside
            x, y = (first[:, i, None] + np.arange(size[i], dtype=np.int32) for i in (0, 1))
            gap_x = ((x + 0.5 - centre[:, :1]) ** 2).astype(np.float32)
            gap_y = ((y + 0.5 - centre[:, 1:2]) ** 2).astype(np.float32)
            near = gap_y[:, :, None] + gap_x[:, None, :] <= (radius**2)[:, None, None]
        spot, up, across = np.nonzero(near)
        pixel = y[spot, up] * self.shape[1] + x[spot, across]
        depth = centre[spot, 2].astype(np.float32)
        won = self._nearer(pixel, depth)
        self.colour[pixel[won]], self.alpha[pixel[won]] = colour[spot[won]], 1.0

    def _nearer(
        self, pixel: Int[np.ndarray, " M"], depth: Float[np.ndarray, " M"]
    ) -> Int[np.ndarray, " W"]:
        """Enter depths at pixels; which of them are the nearest there, as near as any before."""
        some = np.flatnonzero(depth >= self.depth[pixel])
        pixel, depth = pixel[some], depth[some]
        np.maximum.at(self.depth, pixel, depth)
        nearest: np.ndarray = some[depth == self.depth[pixel]]
        return nearest

    def outline(self, step: float, dark: float = 0.35) -> None:
        """Darken the pixels beside which depth changes by more than ``step``."""
        depth = np.where(np.isfinite(self.depth), self.depth, -1e9).reshape(self.shape)
        drop: Bool[np.ndarray, "H W"] = np.zeros(self.shape, bool)
        drop[1:] |= np.abs(depth[1:] - depth[:-1]) > step
        drop[:, 1:] |= np.abs(depth[:, 1:] - depth[:, :-1]) > step
        edge = drop.ravel()
        self.colour[edge] *= dark
        self.alpha[edge] = 1.0

    def translucent(self, triangles: Triangles) -> None:
        """Draw translucent triangles over what is opaque, those behind it left out: at each pixel
        from the nearest to the farthest, in one pass."""
        keys = []
        z = triangles.corners[:, :, 2]
        low, high = (float(z.min()), float(z.max())) if len(z) else (0.0, 1.0)
        step = max(high - low, 1e-12) / ((1 << _DEPTH_BITS) - 1)
        for triangle, pixel, depth in _fragments(triangles.corners, self.shape):
            before = depth > self.depth[pixel]
            far = ((high - depth[before].astype(float)) / step).clip(0, (1 << _DEPTH_BITS) - 1)
            key = pixel[before].astype(np.int64) << _DEPTH_BITS | far.astype(np.int64)
            keys.append(key << _ITEM_BITS | triangle[before])
        if not keys or not sum(map(len, keys)):
            return
        key = np.sort(np.concatenate(keys))
        pixel = (key >> _DEPTH_BITS + _ITEM_BITS).astype(np.int32)
        item = (key & (1 << _ITEM_BITS) - 1).astype(np.int32)
        first = np.flatnonzero(np.diff(pixel, prepend=np.int32(-1)))
        count = np.diff(first, append=len(key))
        alpha = np.minimum(triangles.alpha, 1 - 1e-6)
        lost = np.log1p(-alpha)[item]
        passed = np.cumsum(lost)
        start = passed[first] - lost[first]
        rest = np.exp(passed[first + count - 1] - start).astype(np.float32)
        passed -= np.repeat(start, count)
        passed -= lost
        share = np.exp(passed, dtype=np.float32, casting="same_kind")  # of the light that gets by
        shown = shaded(triangles.colour, triangles.light.mean(axis=1)) * alpha[:, None]
        under = pixel[first]
        for i in range(3):
            veil = np.add.reduceat(share * shown[:, i].astype(np.float32)[item], first)
            self.colour[under, i] = veil + rest * self.colour[under, i]
        self.alpha[under] = 1 - rest * (1 - self.alpha[under])

    def image(self, finer: int) -> Float[np.ndarray, "H W 4"]:
        """The picture (H, W, 4), row 0 at the bottom, each pixel the mean of ``finer`` by ``finer``
        of the buffer's; colours not multiplied by the opacity."""
        rows, columns = (n // finer for n in self.shape)
        image = np.zeros((rows, columns, 4), np.float32)
        for i in range(finer):
            for j in range(finer):
                image[..., :3] += self.colour.reshape(*self.shape, 3)[i::finer, j::finer]
                image[..., 3] += self.alpha.reshape(self.shape)[i::finer, j::finer]
        image[..., :3] /= np.maximum(image[..., 3:], 1e-6)
        image[..., 3] /= finer**2
        return image
