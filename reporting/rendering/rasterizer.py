"""Rasterizer of triangles with a depth buffer, in NumPy; it knows no camera.

Screen coordinates are pixels: x to the right, y up, the centre of the pixel in column i and row j
at (i + 1/2, j + 1/2). Depth grows towards the eye and is affine over a triangle. A pixel belongs to
a triangle if its centre lies inside. Triangles that share an edge share no pixel and leave no gap.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

_MOST = 3_000_000  # pixels processed at once; bounds the memory
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
    """Light at each corner in [0, 1], interpolated in between; ``UNLIT`` leaves colours as they
    are.
    """
    alpha: Float[np.ndarray, " N"]
    """Opacity in [0, 1]."""

    def __len__(self) -> int:
        return len(self.alpha)

    @staticmethod
    def joined(parts: "list[Triangles]") -> "Triangles":
        """Join several sets of triangles into one."""
        return Triangles(
            *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Triangles))
        )


def shaded(
    colour: Float[np.ndarray, "N 3"], light: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N 3"]:
    """Return colours (N, 3) under light (N,): half ambient, half diffuse, and a highlight."""
    lit = np.clip(light, 0, 1)[:, None]
    square = lit * lit
    bright = colour * (0.5 + 0.5 * lit) + 0.25 * square * square * square
    return np.clip(np.where(light[:, None] < 0, colour, bright), 0, 1)


def _expand(count: Int[np.ndarray, " N"]) -> tuple[Int[np.ndarray, " M"], Int[np.ndarray, " M"]]:
    """Expand runs of ``count`` (N,) elements.

    Returns:
        For each element the index of its run, and its index within the run.
    """
    run = np.repeat(np.arange(len(count), dtype=np.int32), count)
    first = np.cumsum(count) - count
    return run, np.arange(len(run), dtype=np.int32) - first.astype(np.int32)[run]


def _planes(
    corners: Float[np.ndarray, "N 3 3"], value: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, "N 3"]:
    """Return coefficients (N, 3) of 1, x and y of the affine functions with given values at the
    corners.
    """
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
    """Return the pixel rows of triangles: triangle, row, first column, number of pixels."""
    order = np.argsort(corners[:, :, 1], axis=1, kind="stable")
    (xa, xb, xc), (ya, yb, yc) = (
        np.take_along_axis(corners[:, :, i], order, axis=1).T for i in (0, 1)
    )
    # upwards, so that both triangles at an edge get the same result
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
    """Yield all pixels of triangles in parts.

    Args:
        corners: x, y and depth of the corners.
        shape: rows and columns of the picture.

    Yields:
        For each pixel the index of its triangle, its index in row-major order, and its depth.
    """
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
    """A picture with the nearest opaque triangle at each pixel, and translucent ones over it.

    Colours are premultiplied by opacity.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.shape = shape
        pixels = shape[0] * shape[1]
        self.depth = np.full(pixels, -np.inf, np.float32)
        self.colour = np.zeros((pixels, 3), np.float32)
        self.alpha = np.zeros(pixels, np.float32)

    def opaque(self, triangles: Triangles) -> None:
        """Draw opaque triangles.

        The nearest triangle wins at each pixel, also against earlier calls; the last wins a tie.
        """
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
        """Draw discs that face the eye. Those with a centre or a radius that is no number are left
        out.

        Args:
            centre: x and y in pixels, and depth (N, 3).
            radius: radii (N,), pixels.
            colour: red, green and blue (N, 3) in [0, 1].
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
        """Store depths at pixels; return the indices that are nearest there, including ties with
        earlier ones.
        """
        some = np.flatnonzero(depth >= self.depth[pixel])
        pixel, depth = pixel[some], depth[some]
        np.maximum.at(self.depth, pixel, depth)
        nearest: np.ndarray = some[depth == self.depth[pixel]]
        return nearest

    def outline(self, step: float, dark: float = 0.35) -> None:
        """Darken pixels at which depth changes by more than ``step`` to a neighbour."""
        depth = np.where(np.isfinite(self.depth), self.depth, -1e9).reshape(self.shape)
        drop: Bool[np.ndarray, "H W"] = np.zeros(self.shape, bool)
        drop[1:] |= np.abs(depth[1:] - depth[:-1]) > step
        drop[:, 1:] |= np.abs(depth[:, 1:] - depth[:, :-1]) > step
        edge = drop.ravel()
        self.colour[edge] *= dark
        self.alpha[edge] = 1.0

    def translucent(self, triangles: Triangles) -> None:
        """Blend translucent triangles over the opaque ones, from the nearest to the farthest in one
        pass.

        Triangles behind opaque ones are left out.
        """
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
        share = np.exp(passed, dtype=np.float32, casting="same_kind")  # share of light that passes
        shown = shaded(triangles.colour, triangles.light.mean(axis=1)) * alpha[:, None]
        under = pixel[first]
        for i in range(3):
            veil = np.add.reduceat(share * shown[:, i].astype(np.float32)[item], first)
            self.colour[under, i] = veil + rest * self.colour[under, i]
        self.alpha[under] = 1 - rest * (1 - self.alpha[under])

    def image(self, finer: int) -> Float[np.ndarray, "H W 4"]:
        """Return the picture (H, W, 4), row 0 at the bottom, with colours not premultiplied.

        Each pixel is the mean of ``finer`` by ``finer`` pixels of the buffer.
        """
        rows, columns = (n // finer for n in self.shape)
        image = np.zeros((rows, columns, 4), np.float32)
        for i in range(finer):
            for j in range(finer):
                image[..., :3] += self.colour.reshape(*self.shape, 3)[i::finer, j::finer]
                image[..., 3] += self.alpha.reshape(self.shape)[i::finer, j::finer]
        image[..., :3] /= np.maximum(image[..., 3:], 1e-6)
        image[..., 3] /= finer**2
        return image
