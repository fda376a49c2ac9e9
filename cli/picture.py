"""The picture of a placement: robot, rings, what the sensors see and what stays unseen, from two sides.

matplotlib's 3D axes do not sort by depth across artists. So every view is painted by hand: solids become polygons, a
camera projects them, and collections draw them from far to near.
"""

import os
from collections import Counter
from collections.abc import Sequence
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection, PolyCollection
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
from ..objectives.scene import Scene
from ..placement.errors import UserError

# Okabe and Ito's colours, told apart by every kind of colour vision: cool ones see, the hot one is unseen.
LINK_COLOURS = ("#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#F0E442")
UNSEEN_COLOUR = "#D55E00"
# Caption, azimuth and elevation of the eye in degrees, and its distance in diagonals of the box.
VIEWS = (("oblique view", -58.0, 22.0, 4.0), ("from above", -90.0, 89.99, 1000.0))

_INK, _GREY, _GRID = "#23272b", "#666d75", "#d9dde1"
_TARGET, _TARGET_EDGE, _LINK, _JOINT = "#f5f5f5", "#8f8a80", "#b4bbc3", "#7d8791"
_SAMPLES = 5_000  # points in the target, of which the unseen become dots
_LINK_RADIUS, _JOINT_RADIUS, _FOOT, _RING_WIDTH, _SENSOR_RADIUS = 0.048, 0.062, 0.095, 0.04, 0.0085  # m
_UP, _DISC = np.eye(3)[2], np.array([(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, 48, endpoint=False)])


class Sheet:
    """What an eye sees of ``box`` (2, 3) m, lower and upper corner: polygons, painted on ``ax`` from far to near."""

    def __init__(self, ax: Axes, box: Any, azimuth_deg: float, elevation_deg: float, diagonals: float) -> None:
        """Look at the middle of ``box`` from a distance of so many of its diagonals."""
        (sa, ca), (se, ce) = ((np.sin(np.radians(v)), np.cos(np.radians(v))) for v in (azimuth_deg, elevation_deg))
        right, up, towards_eye = (-sa, ca, 0.0), (-se * ca, -se * sa, ce), (ce * ca, ce * sa, se)
        self.ax, self.box, self.rotation = ax, box, np.array([right, up, towards_eye])
        self.size = float(np.linalg.norm(box[1] - box[0]))
        self.distance = diagonals * self.size
        self.polygons: list[tuple[float, Any, Any, Any, float]] = []  # depth, outline (M, 2), colour, edge's, edge's width

    def project(self, points: Any) -> tuple[Any, Any]:
        """Picture coordinates (..., 2), m at the box's middle, and depths (...), larger is nearer, of points (..., 3)."""
        seen = (points - self.box.mean(axis=0)) @ self.rotation.T
        return seen[..., :2] * (self.distance / (self.distance - seen[..., 2:])), seen[..., 2]

    def surface(self, faces: Any, colour: str) -> None:
        """Add opaque flat faces (N, M, 3) m, lit from the upper left behind the eye."""
        normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12) @ self.rotation.T
        light = np.clip(np.where(normal[:, 2:] < 0, -1, 1) * (normal @ [[-0.45], [0.6], [0.66]]), 0, 1)
        rgb = np.clip(np.array(to_rgb(colour)) * (0.5 + 0.5 * light) + 0.25 * light**6, 0, 1)
        outlines, depths = self.project(faces)
        self.polygons += [(d, xy, (*c,), (*c,), 0.4) for d, xy, c in zip(depths.mean(axis=1), outlines, rgb, strict=True)]

    def paint(self) -> Collection:
        """Draw what was added so far and forget it."""
        _, outlines, colours, edges, widths = zip(*sorted(self.polygons, key=lambda polygon: polygon[0]), strict=True)
        painted = PolyCollection(outlines, facecolors=colours, edgecolors=edges, linewidths=widths, zorder=2)
        self.polygons = []
        return self.ax.add_collection(painted, autolim=False)


def _circle(centre: Any, axis: Any, radius: float) -> Any:
    """Points (T, 3) m of a circle about the unit ``axis``."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return centre + radius / np.linalg.norm(u) * (_DISC @ np.stack([u, np.cross(axis, u)]))


def _loft(circles: Any) -> Any:
    """Faces (N, 4, 3) m between neighbouring circles (C, T, 3)."""
    turned = np.roll(circles, -1, axis=1)
    return np.stack([circles[:-1], turned[:-1], turned[1:], circles[1:]], axis=2).reshape(-1, 4, 3)


def _ball(c: Any, r: float, n: int) -> Any:
    """Circles of latitude (n, T, 3) m of the ball about ``c`` (3,) of radius ``r``."""
    return np.array([_circle(c + r * np.sin(b) * _UP, _UP, r * np.cos(b)) for b in np.pi * np.linspace(-0.5, 0.5, n)])


def _rod(a: Any, b: Any, radius: float) -> Any:
    """Circles (C, T, 3) m from ``a`` to ``b``, close enough together to be sorted by depth."""
    return np.array([_circle(p, (b - a) / np.linalg.norm(b - a), radius) for p in np.linspace(a, b, 20)])


def _body(robot: Robot, frames: Any) -> Any:
    """Centreline (P, 3) m of the links' bodies: joint origins, and the mount axes where links have them."""
    points = [np.zeros(3)]
    for j, T in enumerate(frames):
        ends = [m.start + t * m.axis for m in robot.mounts if m.frame == j for t in (0.0, m.length)]
        points += [T[:3, :3] @ p + T[:3, 3] for p in (np.zeros(3), *ends)]
    return np.array([p for i, p in enumerate(points) if i == 0 or np.linalg.norm(p - points[i - 1]) > 1e-6])


def _lengths(cones: Cones, outer: Solid) -> Any:
    """Length (K,) m at which each cone is drawn: where its axis leaves the target for the last time, at most its range."""
    share = np.linspace(0, 1, 61)[1:]
    points = cones.apex[:, None] + (share[:, None] * cones.range_m[:, None, None]) * cones.axis[:, None]
    inside = outer(points.reshape(-1, 3)).reshape(points.shape[:2]) <= 0.02
    return cones.range_m * np.where(inside, share, 0.1).max(axis=1)


def _convex_pieces(outer: Any) -> list[Any]:
    """Point sets (_, 3) m whose convex hulls together make the target's outer solid: balls and a tube."""
    if isinstance(outer, Union):
        return _convex_pieces(outer.a) + _convex_pieces(outer.b)
    if isinstance(outer, Spheres):
        return [_ball(c, r, 41).reshape(-1, 3) for c, r in zip(outer.centre, outer.radius, strict=True)]
    discs = [_circle(c, n, outer.radius) for c, n in zip(outer.centre, outer.normal, strict=True)]
    return [np.concatenate([discs[i], discs[i + 1]]) for i in outer.first]


def _draw_room(sheet: Sheet) -> None:
    """Floor and far walls of the box, ruled in metres of the base frame; from above the floor alone."""
    (low, high), walls = sheet.box, sheet.rotation[2, 2] < 0.99
    far = np.where(sheet.rotation[2] > 0, low, high)
    near, unit, step = low + high - far, 0.035 * sheet.size, 0.5 if (high - low).max() < 2.8 else 1.0
    ticks = [step * np.arange(np.ceil(low[i] / step), np.floor(high[i] / step) + 1) + 0.0 for i in range(3)]

    def rule(i: int, along: int, t: float, start: Any) -> Any:  # the line over the box at t on axis i
        ends = np.array([start, start])
        ends[:, i], ends[:, along] = t, sheet.box[:, along]
        return sheet.project(ends)[0]

    faces = [(0, 1), (1, 0), *([(0, 2), (2, 0), (1, 2), (2, 1)] if walls else [])]
    rules = [rule(i, j, t, far) for i, j in faces for t in (low[i], *ticks[i], high[i])]
    sheet.ax.add_collection(LineCollection(rules, colors=_GRID, linewidths=0.8, zorder=0))
    front, left = np.array([near[0], near[1], low[2]]), np.array([far[0], near[1], low[2]])
    for i, start in enumerate((front, front, left) if walls else (front, front)):
        a, b = rule(i, i, 0, start)
        x, y = (b - a) / np.linalg.norm(b - a)
        out = np.array([y, -x]) * np.sign(a @ [y, -x])  # away from the middle, which is at 0
        for t in ticks[i]:
            if i == 2 or not walls or abs(t - near[i]) > 0.12 * step:  # x and y meet at the near corner
                u, v = sheet.project(np.array([*start[:i], t, *start[i + 1 :]]))[0] + unit * out
                sheet.ax.text(u, v, f"{t:g}", color=_GREY, fontsize=9, ha="center", va="center")
        name, angle = (a + b) / 2 + 2.2 * unit * out, (np.degrees(np.arctan2(y, x)) + 80) % 180 - 80
        sheet.ax.text(name[0], name[1], f"{'xyz'[i]} (m)", color=_INK, fontsize=10, rotation=angle, ha="center", va="center")
        sheet.ax.update_datalim([name + 0.6 * unit * out])


def _draw_seen(sheet: Sheet, cones: Cones, colours: list[Any], outer: Solid) -> None:
    """The target's outline and in it the cones, each in its colour (K,)."""
    hulls = [xy[ConvexHull(xy).vertices] for xy, _ in map(sheet.project, _convex_pieces(outer))]
    for face, edge, width in (("none", _TARGET_EDGE, 2.2), (_TARGET, _TARGET, 0.3)):  # of the edges the outline stays
        sheet.ax.add_collection(PolyCollection(hulls, facecolors=face, edgecolors=edge, linewidths=width, zorder=1))
    for k, length in enumerate(_lengths(cones, outer)):
        veil, rgb = min(0.16, 2 / colours.count(colours[k])), to_rgb(colours[k])
        rim = _circle(cones.apex[k] + length * cones.axis[k], cones.axis[k], length * np.tan(cones.half_angle[k]))
        xy, depth = sheet.project(np.vstack([cones.apex[k], rim]))
        for outline, opacity, width in ((xy[ConvexHull(xy).vertices], 0.12, 0.4), (xy[1:], 0.25, 0.5)):
            sheet.polygons.append((depth.mean(), outline, (*rgb, veil), (*rgb, opacity * max(1, 16 * veil)), width))
    sheet.paint().set_clip_path(Outline.make_compound_path(*map(Outline, hulls)), sheet.ax.transData)


def _draw_robot(sheet: Sheet, scene: Scene, setup: Setup, cones: Cones, colour: dict[str, str], unseen: Any) -> None:
    """Over the cones: robot, rings, sensors and the unseen points, which hide each other as they should."""
    frames: Any = forward(scene.robot.chain, scene.poses[0].q)
    line = _body(scene.robot, frames)
    for a, b in pairwise(line):
        sheet.surface(_loft(_rod(a, b, _LINK_RADIUS)), _LINK)
    foot = np.array([_circle(line[0] + height * _UP, _UP, r) for height, r in ((0, _FOOT), (0.03, _FOOT), (0.03, 0.001))])
    for circles in (foot, *(_ball(p, _JOINT_RADIUS, 13) for p in line[1:-1])):
        sheet.surface(_loft(circles), _JOINT)
    for ring in setup.rings:
        m = scene.robot.mount(ring.link)
        R, origin = frames[m.frame][:3, :3], frames[m.frame][:3, 3]
        ends = [m.start + (ring.position * m.length + t) * m.axis for t in (-_RING_WIDTH / 2, _RING_WIDTH / 2)]
        band = np.array([_circle(origin + R @ end, R @ m.axis, ring.radius) for end in ends])
        sheet.surface(_loft(band), colour[ring.link])
    for xy, depth in zip(*sheet.project(cones.apex), strict=True):  # a little nearer than the ring they sit on
        sheet.polygons.append((depth + 0.02, xy + _SENSOR_RADIUS * _DISC, (1, 1, 1), to_rgb(_INK), 1.4 / sheet.size))
    dot, rgb = (0.0022 if len(unseen) > _SAMPLES / 4 else 0.003) * sheet.size * _DISC[::4], np.array(to_rgb(UNSEEN_COLOUR))
    for xy, depth in zip(*sheet.project(unseen), strict=True):
        pale = np.clip(0.2 - 0.8 * depth / sheet.size, 0, 0.6)  # with distance
        sheet.polygons.append((depth, xy + dot, (*((1 - pale) * rgb + pale),), (0, 0, 0, 0), 0.0))
    sheet.paint()


def _write(path: Path, figure: Figure) -> None:
    """Write the figure as a PNG beside ``path`` and rename it: the old file or the new, never half."""
    canvas, temporary = FigureCanvasAgg(figure), path.with_name(f".{path.name}.{os.getpid()}")
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3] // 5 * 5  # 52 steps of a channel, half the file; white stays white
    try:
        with temporary.open("wb", buffering=0) as file:
            Image.fromarray(pixels).save(file, "png", optimize=True)
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)


def placement_picture(path: Path, scene: Scene, setup: Setup, zeta_lines: Sequence[str], seed: int = 0) -> None:
    """Draw ``setup``, one ring or more, in the first pose of ``scene`` and its first goal's target: a PNG of 1800 x 900.

    Args:
        path: the file; its folder exists.
        zeta_lines: the title, one text for each target, such as "V_S(0.5): 97.9 % covered".
        seed: of the points that show what is unseen.

    Raises:
        UserError: if the file cannot be written; an old one stays as it was.
    """
    robot, q, target = scene.robot, scene.poses[0].q, scene.goals[0].target
    solid, cones = target_solid(target, robot, q, scene.shape), sensor_cones(robot, setup, q)
    unseen = (points := sample(solid, _SAMPLES, seed))[cones(points) > 0]
    corners = np.vstack([*_convex_pieces(solid.a), _body(robot, forward(robot.chain, q)), cones.apex])
    box = np.stack([corners.min(axis=0) - 0.05, corners.max(axis=0) + 0.05])
    colour = dict(zip(robot.links, cycle(LINK_COLOURS), strict=False))
    figure = Figure(figsize=(12, 6), dpi=150, facecolor="white")
    for left, (caption, *eye) in zip((0.01, 0.51), VIEWS, strict=True):
        sheet = Sheet(figure.add_axes((left, 0.085, 0.48, 0.765), aspect="equal", xmargin=0.01, ymargin=0.01), box, *eye)
        _draw_room(sheet)
        _draw_seen(sheet, cones, [colour[ring.link] for ring in setup.rings for _ in range(ring.count)], solid.a)
        _draw_robot(sheet, scene, setup, cones, colour, unseen)
        sheet.ax.axis("off")
        sheet.ax.text(0, 1.01, caption, transform=sheet.ax.transAxes, fontsize=11, color=_GREY, style="italic")
    title, rings = "   ·   ".join(zeta_lines), Counter(ring.link for ring in setup.rings)
    figure.text(0.5, 0.945, title, ha="center", fontsize=min(18, 1300 / max(1, len(title))), color=_INK, weight="bold")
    parts = [robot.name, *([f"pose 0 of {len(scene.poses)}"] * (len(scene.poses) > 1)), f"{setup.sensors} sensors"]
    parts += [f"{n} ring{'s' * (n > 1)} on the {link.replace('_', ' ')}" for link, n in rings.items()]
    figure.text(0.5, 0.9, "  ·  ".join(parts), ha="center", fontsize=11, color=_GREY)
    key = [
        *(Patch(fc=(*to_rgb(colour[k]), 0.4), ec=colour[k], label=f"seen from the {k.replace('_', ' ')}") for k in rings),
        Line2D([], [], linestyle="", marker="o", markersize=5, color=UNSEEN_COLOUR, label=f"unseen part of {target}"),
        Patch(fc=_TARGET, ec=_TARGET_EDGE, label=f"target {target}"),
    ]
    figure.legend(handles=key, loc="lower center", ncols=len(key), frameon=False, fontsize=min(10.5, 54 / len(key)))
    _write(path, figure)
