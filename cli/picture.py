"""The picture of a placement: robot, rings, what the sensors see and what stays unseen, from two sides.

matplotlib's 3D axes do not sort by depth across artists. So every view is painted by hand: solids become polygons, a
camera projects them, and one collection draws them from far to near.
"""

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
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
from scipy.spatial import ConvexHull

from ..coverage.chain import forward
from ..coverage.points import sample
from ..coverage.rings import Setup, sensor_cones
from ..coverage.robots import Robot
from ..coverage.solids import Cones, Solid, Spheres, Union
from ..coverage.targets import target_solid
from ..coverage.tube import Tube
from ..objectives.scene import Scene

# Okabe and Ito's colours, told apart by every kind of colour vision.
LINK_COLOURS = ("#0072B2", "#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442")
UNSEEN_COLOUR = "#D55E00"
PAPER_NAMES = {"upper_arm": "shoulder", "forearm": "elbow"}
VIEWS = ((-58.0, 22.0), (122.0, 22.0))  # azimuth and elevation of the eye, degrees

_INK, _GRID, _TARGET, _BODY = "#2b2f33", "#dcdfe3", "#f4f1ec", "#aeb6bf"
_SAMPLES, _MOST_DOTS = 20_000, 2_500
_LINK_RADIUS, _JOINT_RADIUS, _DOT = 0.048, 0.062, 0.011  # m
_TURN = np.linspace(0, 2 * np.pi, 28, endpoint=False)


@dataclass(frozen=True)
class Camera:
    """An eye at ``distance`` m from ``centre`` (3,) m; rows of ``rotation`` (3, 3): right, up, towards the eye."""

    rotation: Float[np.ndarray, "3 3"]
    centre: Float[np.ndarray, " 3"]
    distance: float

    @classmethod
    def at(cls, azimuth_deg: float, elevation_deg: float, centre: Any, distance: float) -> "Camera":
        """Camera that looks at ``centre`` from the given direction, z up."""
        a, e = np.radians([azimuth_deg, elevation_deg])
        right = np.array([-np.sin(a), np.cos(a), 0])
        toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return cls(np.stack([right, np.cross(toward, right), toward]), centre, distance)

    def project(self, points: Any) -> tuple[Any, Any]:
        """Picture coordinates (..., 2), m at the centre's depth, and depths (...), larger is nearer, of points (..., 3)."""
        seen = (points - self.centre) @ self.rotation.T
        return seen[..., :2] * (self.distance / (self.distance - seen[..., 2:])), seen[..., 2]


@dataclass
class Sheet:
    """Polygons of one view, each with a depth, to be painted from far to near."""

    camera: Camera
    outlines: list[Any] = field(default_factory=list)
    looks: list[tuple[float, Any, Any, float]] = field(default_factory=list)

    def add(self, polygon: Any, depth: float, face: Any, edge: Any = (0, 0, 0, 0), width: float = 0.0) -> None:
        """Add a polygon (M, 2) already projected."""
        self.outlines.append(polygon)
        self.looks.append((float(depth), face, edge, width))

    def surface(self, quads: Float[np.ndarray, "N M 3"], colour: str, lift: float = 0.0) -> None:
        """Add flat faces, lit from the upper left of the eye."""
        normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        facing = normal @ self.camera.rotation.T
        facing *= np.where(facing[:, 2:] < 0, -1, 1)
        light = np.clip(facing @ (np.array([-0.45, 0.6, 0.66])), 0, 1)
        rgb = np.array(to_rgb(colour)) * (0.5 + 0.5 * light)[:, None] + 0.28 * light[:, None] ** 6
        xy, depth = self.camera.project(quads)
        for outline, d, c in zip(xy, depth.mean(axis=1) + lift, np.clip(rgb, 0, 1), strict=True):
            self.add(outline, d, (*c, 1.0), (*c, 1.0), 0.4)

    def paint(self, ax: Axes) -> None:
        """Draw all polygons on ``ax``."""
        order = np.argsort([look[0] for look in self.looks], kind="stable")
        _, faces, edges, widths = zip(*(self.looks[i] for i in order), strict=True)
        ax.add_collection(
            PolyCollection([self.outlines[i] for i in order], facecolors=faces, edgecolors=edges, linewidths=widths)
        )


def _across(axis: Any) -> tuple[Any, Any]:
    """Two unit vectors that with the unit ``axis`` (3,) form a right-handed frame."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def _circle(centre: Any, axis: Any, radius: float) -> Any:
    """Points (28, 3) m of a circle about the unit ``axis``."""
    u, v = _across(axis)
    return centre + radius * (np.cos(_TURN)[:, None] * u + np.sin(_TURN)[:, None] * v)


def _loft(circles: Any) -> Any:
    """Faces (N, 4, 3) m between neighbouring circles (C, 28, 3)."""
    following = np.roll(circles, -1, axis=1)
    return np.stack([circles[:-1], following[:-1], following[1:], circles[1:]], axis=2).reshape(-1, 4, 3)


def _ball(centre: Any, radius: float) -> Any:
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 13)
    z = np.array([0.0, 0.0, 1.0])
    return _loft(np.array([_circle(centre + radius * np.sin(b) * z, z, radius * np.cos(b)) for b in latitude]))


def _rod(a: Any, b: Any, radius: float) -> Any:
    axis = (b - a) / np.linalg.norm(b - a)
    steps = np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / 0.03)))
    return _loft(np.array([_circle(a + t * (b - a), axis, radius) for t in steps]))


def _body(robot: Robot, frames: Any) -> Any:
    """Centreline (P, 3) m of the links' bodies: joint origins, and the mount axes where links have them."""
    points = [np.zeros(3)]
    for j, T in enumerate(frames):
        points.append(T[:3, 3])
        for m in robot.mounts:
            if m.frame == j and m.length > 0:
                points += [T[:3, :3] @ (m.start + t * m.axis) + T[:3, 3] for t in (0.0, m.length)]
    line = np.array(points)
    return line[np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6]]


def _lengths(cones: Cones, outer: Solid) -> Any:
    """Length (K,) m at which each cone is drawn: where its axis leaves the target for the last time, at most its range."""
    share = np.linspace(0, 1, 61)[1:]
    points = cones.apex[:, None] + (share[:, None] * cones.range_m[:, None, None]) * cones.axis[:, None]
    inside = outer(points.reshape(-1, 3)).reshape(len(cones), -1) <= 0.02
    return np.where(inside, share, 0.1).max(axis=1) * cones.range_m


def _convex_pieces(outer: Solid) -> list[Any]:
    """Point sets whose convex hulls together make the target's outer solid."""
    if isinstance(outer, Union):
        return _convex_pieces(outer.a) + _convex_pieces(outer.b)
    if isinstance(outer, Spheres):
        return [_ball(c, r).reshape(-1, 3) for c, r in zip(outer.centre, outer.radius, strict=True)]
    assert isinstance(outer, Tube)
    discs = [_circle(c, n, outer.radius) for c, n in zip(outer.centre, outer.normal, strict=True)]
    return [np.concatenate([discs[i], discs[i + 1]]) for i in outer.first]


def _hull(xy: Any) -> Any:
    return xy[ConvexHull(xy).vertices]


def _room(ax: Axes, camera: Camera, low: Any, high: Any) -> None:
    """Floor and the two far walls of the box, ruled every half metre, with the base frame's metres along the edges."""
    far = np.where(camera.rotation[2] > 0, low, high)
    near = low + high - far
    lines = []
    ticks = [np.arange(low[i], high[i] + 1e-9, 0.5) for i in range(3)]
    for i, j, k in ((0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 0, 1), (1, 2, 0), (2, 1, 0)):
        for t in ticks[i]:
            a, b = np.zeros((2, 3))
            a[i] = b[i] = t
            a[k] = b[k] = low[2] if k == 2 else far[k]
            a[j], b[j] = low[j], high[j]
            lines.append(camera.project(np.stack([a, b]))[0])
    ax.add_collection(LineCollection(lines, colors=_GRID, linewidths=0.7))
    middle = camera.project((low + high) / 2)[0]
    for i, edge in ((0, (0, near[1], low[2])), (1, (near[0], 0, low[2]))):
        _scale(ax, camera, i, np.array(edge, float), ticks[i], middle)
    # z stands on the wall edge that lies farther left or right
    ends = [np.array([far[0], near[1], 0.0]), np.array([near[0], far[1], 0.0])]
    _scale(ax, camera, 2, min(ends, key=lambda e: camera.project(e)[0][0]), ticks[2], middle)


def _scale(ax: Axes, camera: Camera, i: int, edge: Any, ticks: Any, middle: Any) -> None:
    points = np.repeat(edge[None], len(ticks), axis=0)
    points[:, i] = ticks
    xy = camera.project(points)[0]
    along = (xy[-1] - xy[0]) / np.linalg.norm(xy[-1] - xy[0])
    out = np.array([along[1], -along[0]])
    out *= np.sign((xy.mean(axis=0) - middle) @ out)
    for p, t in zip(xy + 0.07 * out, ticks, strict=True):
        ax.text(*p, f"{t:g}", color="#6b7178", fontsize=7, ha="center", va="center")
    ax.text(*(xy.mean(axis=0) + 0.2 * out), f"{'xyz'[i]} (m)", color=_INK, fontsize=8.5, ha="center", va="center")


def _view(ax: Axes, camera: Camera, scene: Scene, setup: Setup, cones: Cones, unseen: Any, outer: Solid, box: Any) -> None:
    _room(ax, camera, *box)
    hulls = [_hull(camera.project(piece)[0]) for piece in _convex_pieces(outer)]
    ax.add_collection(PolyCollection(hulls, facecolors="none", edgecolors="#a39c90", linewidths=1.6))
    ax.add_collection(PolyCollection(hulls, facecolors=_TARGET, edgecolors=_TARGET, linewidths=0.3))
    sheet = Sheet(camera)
    links = scene.robot.links
    colours = np.array([to_rgb(LINK_COLOURS[links.index(r.link)]) for r in setup.rings for _ in range(r.count)])
    length = _lengths(cones, outer)
    for k in range(len(cones)):
        base = cones.apex[k] + length[k] * cones.axis[k]
        rim = _circle(base, cones.axis[k], length[k] * np.tan(cones.half_angle[k]))
        xy, _ = camera.project(np.vstack([cones.apex[k], rim]))
        depth = camera.project((cones.apex[k] + base) / 2)[1]
        sheet.add(_hull(xy), depth, (*colours[k], 0.07), (*colours[k], 0.22), 0.4)
        sheet.add(xy[1:], depth, (*colours[k], 0.05), (*colours[k], 0.25), 0.4)
    frames = forward(scene.robot.chain, scene.poses[0].q)
    line = _body(scene.robot, frames)
    for a, b in zip(line[:-1], line[1:], strict=True):
        sheet.surface(_rod(a, b, _LINK_RADIUS), _BODY)
    for p in line[1:-1]:
        sheet.surface(_ball(p, _JOINT_RADIUS), "#7d8791")
    sheet.surface(_rod(line[0], line[0] + [0, 0, 0.03], 0.095), "#7d8791")
    for ring in setup.rings:
        m = scene.robot.mount(ring.link)
        T = frames[m.frame]
        axis = T[:3, :3] @ m.axis
        centre = T[:3, :3] @ (m.start + ring.position * m.length * m.axis) + T[:3, 3]
        band = np.array([_circle(centre + t * axis, axis, ring.radius) for t in (-0.012, 0.012)])
        sheet.surface(_loft(band), LINK_COLOURS[links.index(ring.link)])
    disc = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
    xy, depth = camera.project(cones.apex)
    for p, d in zip(xy, depth, strict=True):
        sheet.add(p + _DOT * disc, d + 0.02, (1, 1, 1, 1), (*to_rgb(_INK), 1), 0.5)
    xy, depth = camera.project(unseen)
    for p, d in zip(xy, depth, strict=True):
        sheet.add(p + 0.008 * disc[::3], d + 9, (*to_rgb(UNSEEN_COLOUR), 0.9), (1, 1, 1, 0.5), 0.2)
    sheet.paint(ax)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.autoscale_view()


def placement_picture(path: Path, scene: Scene, setup: Setup, zeta_lines: Sequence[str], seed: int = 0) -> None:
    q = scene.poses[0].q
    target = scene.goals[0].target
    solid = target_solid(target, scene.robot, q, scene.shape)
    cones = sensor_cones(scene.robot, setup, q)
    points = sample(solid, _SAMPLES, seed)
    unseen = points[cones(points) > 0][:_MOST_DOTS]
    low, high = solid.bounds()
    box = np.floor(low / 0.5) * 0.5, np.ceil(high / 0.5) * 0.5
    figure = Figure(figsize=(12, 6), dpi=150, facecolor="white")
    for i, (azimuth, elevation) in enumerate(VIEWS):
        ax = figure.add_axes((0.01 + 0.5 * i, 0.09, 0.48, 0.8))
        camera = Camera.at(azimuth, elevation, (box[0] + box[1]) / 2, 4 * float(np.linalg.norm(box[1] - box[0])))
        _view(ax, camera, scene, setup, cones, unseen, solid.a, box)
    figure.text(0.5, 0.95, "   ".join(zeta_lines), ha="center", fontsize=14, color=_INK)
    FigureCanvasAgg(figure).print_png(path)
