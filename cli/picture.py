"""The picture of a placement: robot, rings, what the sensors see and what stays unseen, from two sides.

matplotlib's 3D axes do not sort by depth across artists. So every view is painted by hand: solids become polygons, a
camera projects them, and collections draw them from far to near.
"""

import os
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path as Outline
from PIL import Image
from scipy.spatial import ConvexHull

from ..coverage.chain import forward
from ..coverage.points import sample
from ..coverage.rings import Setup, sensor_cones
from ..coverage.robots import Robot
from ..coverage.solids import Cones, Solid, Spheres, Union
from ..coverage.targets import target_solid
from ..coverage.tube import Tube
from ..objectives.scene import Scene
from ..placement.errors import UserError

# Okabe and Ito's colours, told apart by every kind of colour vision: cool ones see, the hot one is unseen.
LINK_COLOURS = ("#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#F0E442")
UNSEEN_COLOUR = "#D55E00"
# Caption, azimuth and elevation of the eye in degrees, and its distance in diagonals of the box.
VIEWS = (("oblique", -58.0, 22.0, 4.0), ("from above", -90.0, 89.99, 1000.0))

_INK, _GREY, _GRID = "#23272b", "#666d75", "#d9dde1"
_TARGET, _TARGET_EDGE, _LINK, _JOINT = "#f4f4f3", "#8f8a80", "#b4bbc3", "#7d8791"
_SAMPLES, _MOST_DOTS = 20_000, 2_500
_LINK_RADIUS, _JOINT_RADIUS, _BASE_RADIUS, _RING_HALF_HEIGHT, _SENSOR = 0.048, 0.062, 0.095, 0.02, 0.0085  # m
_TURN = np.linspace(0, 2 * np.pi, 48, endpoint=False)
_DISC = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Camera:
    """An eye ``distance`` m away from the middle of ``box`` (2, 3) m; rows of rotation: right, up, towards the eye."""

    rotation: Float[np.ndarray, "3 3"]
    box: Float[np.ndarray, "2 3"]
    distance: float

    @classmethod
    def at(cls, azimuth_deg: float, elevation_deg: float, box: Any, diagonals: float) -> "Camera":
        """Camera that looks at the middle of ``box`` from the given direction, z up."""
        a, e = np.radians([azimuth_deg, elevation_deg])
        right = np.array([-np.sin(a), np.cos(a), 0])
        toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return cls(np.stack([right, np.cross(toward, right), toward]), box, diagonals * np.linalg.norm(box[1] - box[0]))

    def project(self, points: Any) -> tuple[Any, Any]:
        """Picture coordinates (..., 2), m at the box's middle, and depths (...), larger is nearer, of points (..., 3)."""
        seen = (points - self.box.mean(axis=0)) @ self.rotation.T
        return seen[..., :2] * (self.distance / (self.distance - seen[..., 2:])), seen[..., 2]


@dataclass
class Sheet:
    """Polygons of one view, each with depth, face, edge and its width, to be painted from far to near."""

    camera: Camera
    outlines: list[Any] = field(default_factory=list)
    looks: list[tuple[float, Any, Any, float]] = field(default_factory=list)

    def add(self, outline: Any, depth: float, face: Any, edge: Any = (0, 0, 0, 0), width: float = 0.0) -> None:
        """Add a polygon (M, 2) already projected."""
        self.outlines.append(outline)
        self.looks.append((float(depth), face, edge, width))

    def surface(self, faces: Float[np.ndarray, "N M 3"], colour: str) -> None:
        """Add opaque flat faces, lit from the upper left behind the eye."""
        normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        facing = normal @ self.camera.rotation.T
        light = np.clip(np.where(facing[:, 2] < 0, -1, 1) * (facing @ [-0.45, 0.6, 0.66]), 0, 1)[:, None]
        rgb = np.clip(np.array(to_rgb(colour)) * (0.5 + 0.5 * light) + 0.25 * light**6, 0, 1)
        outlines, depth = self.camera.project(faces)
        for outline, d, c in zip(outlines, depth.mean(axis=1), rgb, strict=True):
            self.add(outline, d, (*c, 1.0), (*c, 1.0), 0.4)

    def paint(self, ax: Axes) -> PolyCollection:
        """Draw all polygons on ``ax``."""
        order = np.argsort([look[0] for look in self.looks], kind="stable")
        _, faces, edges, widths = zip(*(self.looks[i] for i in order), strict=True)
        outlines = [self.outlines[i] for i in order]
        painted = PolyCollection(outlines, facecolors=faces, edgecolors=edges, linewidths=widths, zorder=2)
        ax.add_collection(painted)
        return painted


def _circle(centre: Any, axis: Any, radius: float) -> Any:
    """Points (T, 3) m of a circle about the unit ``axis``."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return centre + radius * (_DISC @ np.stack([u, np.cross(axis, u)]))


def _loft(circles: Any) -> Any:
    """Faces (N, 4, 3) m between neighbouring circles (C, T, 3)."""
    turned = np.roll(circles, -1, axis=1)
    return np.stack([circles[:-1], turned[:-1], turned[1:], circles[1:]], axis=2).reshape(-1, 4, 3)


def _ball(centre: Any, radius: float, circles: int) -> Any:
    """Circles of latitude (C, T, 3) m."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, circles)
    return np.array([_circle(centre + radius * np.sin(b) * _UP, _UP, radius * np.cos(b)) for b in latitude])


def _rod(a: Any, b: Any, radius: float) -> Any:
    """Circles (C, T, 3) m from ``a`` to ``b``, close enough together to be sorted by depth."""
    length = np.linalg.norm(b - a)
    return np.array([_circle(a + t * (b - a), (b - a) / length, radius) for t in np.linspace(0, 1, 2 + int(length / 0.03))])


def _body(robot: Robot, frames: Any) -> Any:
    """Centreline (P, 3) m of the links' bodies: joint origins, and the mount axes where links have them."""
    points = [np.zeros(3)]
    for j, T in enumerate(frames):
        points.append(T[:3, 3])
        axes = [m for m in robot.mounts if m.frame == j and m.length > 0]
        points += [T[:3, :3] @ (m.start + t * m.axis) + T[:3, 3] for m in axes for t in (0.0, m.length)]
    line = np.array(points)
    return line[np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6]]


def _lengths(cones: Cones, outer: Solid) -> Any:
    """Length (K,) m at which each cone is drawn: where its axis leaves the target for the last time, at most its range."""
    share = np.linspace(0, 1, 61)[1:]
    points = cones.apex[:, None] + (share[:, None] * cones.range_m[:, None, None]) * cones.axis[:, None]
    inside = outer(points.reshape(-1, 3)).reshape(len(cones), -1) <= 0.02
    return np.where(inside, share, 0.1).max(axis=1) * cones.range_m


def _convex_pieces(outer: Any) -> list[Any]:
    """Point sets (_, 3) m whose convex hulls together make the target's outer solid."""
    if isinstance(outer, Union):
        return _convex_pieces(outer.a) + _convex_pieces(outer.b)
    if isinstance(outer, Spheres):
        return [_ball(c, r, 41).reshape(-1, 3) for c, r in zip(outer.centre, outer.radius, strict=True)]
    if not isinstance(outer, Tube):
        raise TypeError(f"no outline is known for a {type(outer).__name__}")
    discs = [_circle(c, n, outer.radius) for c, n in zip(outer.centre, outer.normal, strict=True)]
    return [np.concatenate([discs[i], discs[i + 1]]) for i in outer.first]


def _hull(points: Any) -> Any:
    return points[ConvexHull(points).vertices]


def _draw_room(ax: Axes, camera: Camera) -> None:
    """Floor and far walls of the box, ruled in metres of the base frame; from above the floor alone."""
    low, high = camera.box
    walls = camera.rotation[2, 2] < 0.99
    far = np.where(camera.rotation[2] > 0, low, high)
    near, edges = low + high - far, []
    step = 0.5 if (high - low).max() < 2.8 else 1.0
    ticks = [step * np.arange(np.ceil(low[i] / step), np.floor(high[i] / step) + 1) + 0.0 for i in range(3)]
    for i, j, k in ((0, 1, 2), (1, 0, 2), *(((0, 2, 1), (2, 0, 1), (1, 2, 0), (2, 1, 0)) if walls else ())):
        for t in (low[i], *ticks[i], high[i]):
            ends = np.zeros((2, 3))
            ends[:, i], ends[:, k], ends[:, j] = t, far[k], (low[j], high[j])
            edges.append(camera.project(ends)[0])
    ax.add_collection(LineCollection(edges, colors=_GRID, linewidths=0.8, zorder=0))
    corners = [np.array([far[0], near[1], 0]), np.array([near[0], far[1], 0])]
    left = min(corners, key=lambda c: camera.project(c)[0][0])
    starts = [np.array([0, near[1], low[2]]), np.array([near[0], 0, low[2]]), left]
    unit = 0.035 * np.linalg.norm(high - low)
    for i in range(3 if walls else 2):
        points = np.repeat(starts[i][None], len(ticks[i]) + 2, axis=0)
        points[:, i] = (low[i], *ticks[i], high[i])
        xy = camera.project(points)[0]
        along = (xy[-1] - xy[0]) / np.linalg.norm(xy[-1] - xy[0])
        out = np.array([along[1], -along[0]])
        out *= np.sign((xy[0] - camera.project(camera.box.mean(axis=0))[0]) @ out)
        centred = {"ha": "center", "va": "center"}
        for p, t in zip(xy[1:-1] + unit * out, ticks[i], strict=True):
            if i == 2 or abs(t - near[i]) > 0.12 * step:  # two axes meet at the near corner
                ax.text(*p, f"{t:g}", color=_GREY, fontsize=9, **centred)
        name = xy[[0, -1]].mean(axis=0) + 2.2 * unit * out
        angle = (np.degrees(np.arctan2(along[1], along[0])) + 80) % 180 - 80
        ax.text(*name, f"{'xyz'[i]} (m)", color=_INK, fontsize=10, rotation=angle, **centred)
        ax.update_datalim([name + 0.6 * unit * out])


def _draw_view(ax: Axes, camera: Camera, scene: Scene, setup: Setup, cones: Cones, unseen: Any, outer: Solid) -> None:
    """Paint one view: room, target, cones within its outline, and over them robot, rings and unseen points."""
    _draw_room(ax, camera)
    hulls = [_hull(camera.project(piece)[0]) for piece in _convex_pieces(outer)]
    for face, edge, width in (("none", _TARGET_EDGE, 2.2), (_TARGET, _TARGET, 0.3)):  # of the edges the outline stays
        ax.add_collection(PolyCollection(hulls, facecolors=face, edgecolors=edge, linewidths=width, zorder=1))
    links = scene.robot.links
    cone_sheet, sheet = Sheet(camera), Sheet(camera)
    colours = [to_rgb(LINK_COLOURS[links.index(r.link) % len(LINK_COLOURS)]) for r in setup.rings for _ in range(r.count)]
    veil = min(0.16, 5 / len(cones))
    for apex, axis, angle, length, colour in zip(
        cones.apex, cones.axis, cones.half_angle, _lengths(cones, outer), colours, strict=True
    ):
        rim = _circle(apex + length * axis, axis, length * np.tan(angle))
        xy, _ = camera.project(np.vstack([apex, rim]))
        depth = camera.project(apex + length / 2 * axis)[1]
        cone_sheet.add(_hull(xy), depth, (*colour, veil), (*colour, max(0.12, 2 * veil)), 0.4)
        cone_sheet.add(xy[1:], depth, (*colour, veil), (*colour, max(0.25, 4 * veil)), 0.5)
    shape = Outline.make_compound_path(*(Outline(hull) for hull in hulls))
    cone_sheet.paint(ax).set_clip_path(shape, ax.transData)
    frames = forward(scene.robot.chain, scene.poses[0].q)
    line = _body(scene.robot, frames)
    for a, b in zip(line[:-1], line[1:], strict=True):
        sheet.surface(_loft(_rod(a, b, _LINK_RADIUS)), _LINK)
    for p in line[1:-1]:
        sheet.surface(_loft(_ball(p, _JOINT_RADIUS, 13)), _JOINT)
    foot = _rod(line[0], line[0] + 0.03 * _UP, _BASE_RADIUS)
    sheet.surface(_loft(foot), _JOINT)
    sheet.surface(foot[-1:], _JOINT)
    for ring in setup.rings:
        m = scene.robot.mount(ring.link)
        T = frames[m.frame]
        axis = T[:3, :3] @ m.axis
        centre = T[:3, :3] @ (m.start + ring.position * m.length * m.axis) + T[:3, 3]
        band = np.array([_circle(centre + t * axis, axis, ring.radius) for t in (-_RING_HALF_HEIGHT, _RING_HALF_HEIGHT)])
        sheet.surface(_loft(band), LINK_COLOURS[links.index(ring.link) % len(LINK_COLOURS)])
    for p, depth in zip(*camera.project(cones.apex), strict=True):
        sheet.add(p + _SENSOR * _DISC, depth + 0.02, (1, 1, 1, 1), (*to_rgb(_INK), 1), 0.5)
    dot = 0.0026 * np.linalg.norm(camera.box[1] - camera.box[0]) * _DISC[::4]
    xy, depths = camera.project(unseen)
    nearest, span = depths.max(initial=-np.inf), np.ptp(np.r_[depths, 0])
    for p, depth in zip(xy, depths, strict=True):
        pale = 0.5 * (nearest - depth) / span
        sheet.add(p + dot, depth, (*(np.array(to_rgb(UNSEEN_COLOUR)) * (1 - pale) + pale), 1.0))
    sheet.paint(ax)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.margins(0.01)
    ax.autoscale_view()
