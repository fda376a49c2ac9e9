"""3D renderer for still pictures, with a depth buffer, drawing into the axes of a figure.

It renders meshes, faces, lines and points in metres, seen by a camera. Nearer parts hide farther
ones.

Add parts in any order with ``Canvas.mesh``, ``faces``, ``lines`` and ``points``. ``Canvas.draw``
puts the picture into the axes at the resolution at which the figure is written. Matplotlib draws
labels, rulers and legends over or under it.
"""

from copy import copy
from typing import Any

import numpy as np
from jaxtyping import Float

from ..outlines import outline
from .colours import Colour, rgb
from .rasterizer import UNLIT, DepthBuffer, Triangles, shaded
from .surface import Surface, vertex_normals

FINER = 2  # supersampling: each pixel is the mean of FINER x FINER
_LIGHT = np.array(
    [-0.45, 0.6, 0.66]
)  # right, up, towards the eye: light from the upper left behind the eye


class Canvas:
    """A camera's view in axes whose coordinates are metres at the depth of the centre of a box."""

    def __init__(
        self,
        ax: Any,
        box: Float[np.ndarray, "2 3"],
        azimuth_deg: float,
        elevation_deg: float,
        diagonals: float = np.inf,
    ) -> None:
        """Look at the centre of a box.

        Args:
            ax: matplotlib axes to draw into, or None to use ``image`` only.
            box: lower and upper corner of the box, m.
            azimuth_deg: azimuth of the eye about the vertical, from +x, degrees.
            elevation_deg: elevation of the eye above the horizontal, degrees.
            diagonals: distance of the eye, in diagonals of the box; infinity gives a parallel
                projection.
        """
        a, e = np.radians([azimuth_deg, elevation_deg])
        right = (-np.sin(a), np.cos(a), 0.0)
        up = (-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e))
        towards_eye = (np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e))
        self.ax, self.box, self.rotation = ax, box, np.array([right, up, towards_eye])
        self.size = float(np.linalg.norm(box[1] - box[0]))
        self.distance = diagonals * self.size
        self._solid: list[Triangles] = []
        self._clear: list[Triangles] = []
        self._lines: list[tuple[Any, Any, float]] = []  # ends, colours, width in points
        self._spots: list[tuple[Any, Any, Any]] = []  # centres, radii m, colours

    def project(self, points: Any) -> tuple[Any, Any]:
        """Project points (..., 3) m.

        Returns:
            Coordinates (..., 2) m in the axes, and depths (...); larger is nearer.
        """
        seen = (points - self.box.mean(axis=0)) @ self.rotation.T
        return seen[..., :2] * self._nearness(seen[..., 2:]), seen[..., 2]

    def unproject(self, xy: Any, depth: Any) -> Any:
        """Return the points (..., 3) m at coordinates (..., 2) m in the axes and depths (...):
        the inverse of ``project``."""
        depth = np.asarray(depth)[..., None]
        seen = np.concatenate([xy / self._nearness(depth), depth], axis=-1)
        return self.box.mean(axis=0) + seen @ self.rotation

    def hull(self, points: Any) -> Any:
        """Return the outline (M, 2) m, in the axes, of the convex hull of points (N, 3) m."""
        return outline(self.project(points)[0])

    def _nearness(self, depth: Any) -> Any:
        return self.distance / (self.distance - depth) if np.isfinite(self.distance) else 1.0

    def _placed(self, points: Any, nearer: float = 0.0) -> Any:
        """Return coordinates (..., 3): two in the axes, and a depth that is affine over a face
        there.

        With perspective that depth is the reciprocal of the distance.
        """
        xy, depth = self.project(points)
        depth = depth + nearer
        if np.isfinite(self.distance):
            depth = self.size * self._nearness(depth)
        return np.concatenate([xy, depth[..., None]], axis=-1)

    def light(self, normal: Any) -> Any:
        """Return the light (...) in [0, 1] on two-sided surfaces with unit normals (..., 3)."""
        seen = normal @ self.rotation.T
        return np.clip(np.where(seen[..., 2] < 0, -1, 1) * (seen @ _LIGHT), 0, 1)

    def lit(self, colour: Colour, normal: Any) -> Any:
        """Return the colours (N, 3) of surfaces with unit normals (N, 3) under the light."""
        return shaded(np.broadcast_to(rgb(colour), normal.shape), self.light(normal))

    def mesh(
        self, surface: Surface, colour: Colour, alpha: float = 1.0, closed: bool = False
    ) -> None:
        """Add a mesh with smooth shading.

        Args:
            surface: vertices and triangles; a vertex that triangles do not share makes a crease.
            colour: one colour, or one for each triangle (T, 3).
            alpha: opacity.
            closed: True if triangles turn anti-clockwise as seen from outside; those that face away
                from the eye are culled. Otherwise both sides are drawn alike.
        """
        vertices, triangles = surface
        view = self._placed(vertices)[triangles]  # (T, 3, 3)
        sides = view[:, 1:, :2] - view[:, :1, :2]
        facing = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
        light = vertex_normals(vertices, triangles) @ (_LIGHT @ self.rotation)
        corner = np.clip(np.sign(facing)[:, None] * light[triangles], 0, 1)
        shown = facing > 0 if closed else facing != 0
        self._add(view[shown], self._each(colour, shown), corner[shown], alpha)

    def faces(
        self, faces: Any, colour: Colour, alpha: float = 1.0, lit: bool = True, nearer: float = 0.0
    ) -> None:
        """Add flat convex faces.

        Args:
            faces: corners (N, M, 3) m, in order around each face.
            colour: one colour, or one for each face (N, 3).
            alpha: opacity.
            lit: True to shade faces by their normals, both sides alike; False for flat colours.
            nearer: depth offset towards the eye, m.
        """
        if not len(faces):
            return
        fan = np.array([(0, i, i + 1) for i in range(1, faces.shape[1] - 1)])
        light = np.full(len(faces), UNLIT)
        if lit:
            normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, -1] - faces[:, 1])
            length = np.linalg.norm(normal, axis=1, keepdims=True)
            light = self.light(normal / np.maximum(length, 1e-300))
        view = self._placed(faces, nearer)[:, fan].reshape(-1, 3, 3)
        colours = np.repeat(self._each(colour, np.ones(len(faces), bool)), len(fan), axis=0)
        self._add(view, colours, np.repeat(light, len(fan))[:, None] * np.ones(3), alpha)

    @staticmethod
    def _each(colour: Colour, shown: Any) -> Any:
        """Return the colours of the shown parts, given one colour or one for each part."""
        given = rgb(colour)
        return given[shown] if given.ndim > 1 else np.broadcast_to(given, (int(shown.sum()), 3))

    def _add(self, view: Any, colour: Any, light: Any, alpha: float) -> None:
        made = Triangles(view, colour, light, np.full(len(view), float(alpha)))
        (self._solid if alpha >= 1 else self._clear).append(made)

    def lines(self, ends: Any, colour: Colour, width: float, nearer: float = 0.0) -> None:
        """Add straight lines.

        Args:
            ends: end points (N, 2, 3) m.
            colour: one colour, or one for each line.
            width: width in points.
            nearer: see ``faces``.
        """
        if len(ends):
            colours = self._each(colour, np.ones(len(ends), bool))
            self._lines.append((self._placed(ends, nearer), colours, width))

    def points(self, points: Any, colour: Colour, radius: float, nearer: float = 0.0) -> None:
        """Add discs that face the eye.

        Args:
            points: centres (N, 3) m.
            colour: one colour, or one for each point.
            radius: radius of the discs, m.
            nearer: see ``faces``.
        """
        points = np.asarray(points, float)
        sound = np.isfinite(points).all(axis=-1) & np.isfinite(radius)
        if not sound.any():
            return
        colours, points = self._each(colour, sound), points[sound]
        radii = (radius * np.ones(len(sound)))[sound] * self._nearness(self.project(points)[1])
        self._spots.append((self._placed(points, nearer), radii, colours))

    def extent(self) -> Float[np.ndarray, "2 2"] | None:
        """Return the lower and upper corner (2, 2) m, in the axes, of all parts; None if there are
        none.
        """
        parts = [t.corners for t in (*self._solid, *self._clear) if len(t)]
        parts += [ends for ends, *_ in self._lines]
        parts += [
            np.concatenate([at[:, :2] - r[:, None], at[:, :2] + r[:, None]])
            for at, r, _ in self._spots
        ]
        flat = [part[..., :2].reshape(-1, 2) for part in parts]
        if not flat:
            return None
        low = np.min([xy.min(axis=0) for xy in flat], axis=0)
        return np.stack([low, np.max([xy.max(axis=0) for xy in flat], axis=0)])

    def image(
        self,
        low: Any,
        pixel: Any,
        shape: tuple[int, int],
        finer: int = FINER,
        outline: float = np.inf,
        point: float = 1.0,
    ) -> Float[np.ndarray, "H W 4"]:
        """Return the picture (H, W, 4): red, green, blue and opacity in [0, 1], row 0 at the
        bottom.

        Args:
            low: lower left corner (2,) m in the axes.
            pixel: width and height of a pixel, m: one number or (2,).
            shape: rows and columns.
            finer: supersampling factor of each side.
            outline: smallest step in depth between neighbouring pixels that gets a dark line, m.
            point: pixels per point of line width.
        """
        scale = finer / (np.asarray(pixel, float) * np.ones(2))
        buffer = DepthBuffer((shape[0] * finer, shape[1] * finer))

        def onto(corners: Any) -> Any:
            return np.concatenate(
                [(corners[..., :2] - low) * scale, corners[..., 2:]], axis=-1, dtype=np.float64
            )

        def triangles(some: list[Triangles]) -> Triangles:
            t = Triangles.joined(some)
            return Triangles(onto(t.corners), t.colour, t.light, t.alpha)

        solid = [triangles(self._solid)] if self._solid else []
        solid += [_strokes(onto(e), c, 0.5 * w * point * finer) for e, c, w in self._lines]
        if solid:
            buffer.opaque(Triangles.joined(solid))
        if np.isfinite(outline):
            buffer.outline(outline + 2.0 / float(scale[0]))
        for centre, radius, colour in self._spots:
            buffer.stamp(onto(centre), radius * scale[0], colour)
        if self._clear:
            buffer.translucent(triangles(self._clear))
        return buffer.image(finer)

    def draw(
        self, fit: bool = True, zorder: float = 2, finer: int = FINER, outline: float = np.inf
    ) -> None:
        """Draw all parts into the axes and clear the canvas.

        Args:
            fit: True to extend the limits of the axes to the picture.
            zorder: order among the artists of the axes.
            finer: see ``image``.
            outline: see ``image``.
        """
        from .artist import RenderedCanvas  # loads matplotlib

        extent = self.extent()
        if extent is None:
            return
        kept = copy(self)
        self._solid, self._clear, self._lines, self._spots = [], [], [], []
        self.ax.add_artist(RenderedCanvas(kept.image, extent, zorder, finer, outline))
        if fit:
            self.ax.update_datalim(extent)


def _strokes(ends: Any, colour: Any, half: float) -> Triangles:
    """Turn lines (N, 2, 3) on the screen into triangles.

    The strokes extend by ``half`` to both sides of a line and beyond both ends.
    """
    way = ends[:, 1, :2] - ends[:, 0, :2]
    way = half * way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    side = np.stack([-way[:, 1], way[:, 0]], axis=1)
    corners = ends[:, [0, 1, 1, 0]].copy()
    corners[..., :2] += np.stack([-way - side, way - side, way + side, side - way], axis=1)
    shown = corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    unlit = np.full((len(shown), 3), UNLIT)
    return Triangles(shown, np.repeat(colour, 2, axis=0), unlit, np.ones(len(shown)))
