"""Picture of a robot with all its printed rings mounted, from the files of the rings."""

import textwrap
from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
from jaxtyping import Float
from manifold3d import Manifold, Mesh
from matplotlib.figure import Figure

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.base_frame import frame_text
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import TCP_FRAME, Robot
from ..formats.printing.print_checks import read_stl
from ..formats.printing.print_plan import MM
from ..formats.schema.print_models import PrintResult
from ..objectives.scene import Scene
from .rendering.canvas import Canvas
from .rendering.figures import add_bar, add_base_axes, png
from .rendering.meshes import capsule_surfaces
from .rendering.surface import Surface
from .text import counted

_SHADES = ((0.90, 0.49, 0.13), (0.98, 0.72, 0.38))
_LINK, _LENS = (0.76, 0.79, 0.84), "#14532d"
_LENS_RADIUS = 0.004  # m
_NEARER = 0.004  # m, how far lenses are drawn in front of the boards that carry them
_CREASE = 30.0  # degrees, angle between faces that makes a sharp edge
_STEP = 0.004  # m, step in depth between neighbouring pixels that gets an outline
_MARGIN, _FOOT = 0.09, 0.06  # m, around the robot, and below it for the scale bar
_PAGE, _TITLE = (15.0, 9.0), 0.5  # inches, largest picture, and room for its title
_LINE = 0.22  # inches, of a line of names
_BADGE = 0.05  # m, wanted distance of a ring's number from others and from all rings
_END_ON = 0.2  # length of a projected axis below which a ring is seen from its end
_LABEL = "#333333"
_AXIS = 0.22  # m, length of a drawn axis of the base
_ASIDE, _ELEVATION = 28.0, 18.0  # degrees, of the eye out of the side view and above it


def printed_parts(
    robot: Robot, result: PrintResult, data: Mapping[str, bytes], frames: Float[np.ndarray, "F 4 4"]
) -> list[list[Manifold]]:
    """Return the parts of each printed ring as solids, m in the base frame, placed by
    ``T_link_print``.

    Args:
        robot: the robot.
        result: records of the rings.
        data: STL files by name.
        frames: T_base_frame from ``forward``.
    """
    names, rings = (*robot.chain.joints, TCP_FRAME), []
    for record in result.rings:
        T_base_link, parts = frames[names.index(record.frame)], []
        lids = [(record.lids.file, T) for T in record.lids.T_link_print] if record.lids else []
        for file, T_link_print in (*record.T_link_print.items(), *lids):
            mesh = read_stl(data[file])
            T = T_base_link @ np.array(T_link_print) @ np.diag([1 / MM, 1 / MM, 1 / MM, 1.0])
            solid = Manifold(
                Mesh(np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32))
            )
            parts.append(solid.transform(T[:3]))
        rings.append(parts)
    return rings


def _surface(solid: Manifold) -> Surface:
    mesh = solid.calculate_normals(0, _CREASE).to_mesh()
    return np.asarray(mesh.vert_properties[:, :3], float), np.asarray(mesh.tri_verts)


def _side(points: Float[np.ndarray, "N 3"]) -> float:
    """Return the azimuth, degrees, from which an arm with these joint origins is seen widest."""
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    along = np.linalg.svd(flat)[2][0]
    return float(np.degrees(np.arctan2(along[1], along[0]))) - 90.0


def _canvas(
    eye: tuple[float, float], bodies: Any, parts: list[list[Surface]], lenses: Any
) -> Canvas:
    """Return a canvas with the robot's bodies, the parts of the rings, and the sensors."""
    ends = np.concatenate([bodies.start, bodies.end])
    canvas = Canvas(None, np.array([ends.min(axis=0), ends.max(axis=0)]), *eye)
    for surface in capsule_surfaces(bodies):
        canvas.mesh(surface, _LINK, closed=True)
    for ring in parts:
        for part, colour in zip(ring, cycle(_SHADES)):
            canvas.mesh(part, colour, closed=True)
    canvas.points(lenses, _LENS, _LENS_RADIUS, _NEARER)
    return canvas


def assembly_picture(
    scene: Scene, setup: Setup, result: PrintResult, data: Mapping[str, bytes]
) -> bytes:
    """Return a PNG of the robot in the scene's first pose with all printed rings, from two opposite
    sides.

    Args:
        scene: the scene.
        setup: the rings.
        result: records of the printed rings.
        data: STL files by name.
    """
    frames = np.asarray(forward(scene.robot.chain, scene.poses[0].q))
    bodies = robot_capsules(scene.robot.enclosed(), frames)
    parts = [
        [_surface(part) for part in ring]
        for ring in printed_parts(scene.robot, result, data, frames)
    ]
    lenses = sensor_cones(scene.robot, setup, scene.poses[0].q).apex
    side = _side(np.vstack([np.zeros(3), frames[:, :3, 3]])) + _ASIDE
    views = [
        _canvas((azimuth, _ELEVATION), bodies, parts, lenses) for azimuth in (side, side + 180.0)
    ]
    title = (
        f"{scene.robot.name} with {counted(len(setup.rings), 'printed ring')}"
        f" and {counted(setup.sensors, 'sensor')}, from two sides;"
        f" axes of {frame_text(scene.robot)}"
    )
    figure = _side_by_side(views, title, [f"{r.ring} {r.link}" for r in result.rings])
    axes = [
        frames[scene.robot.mount(ring.link).frame][:3, :3] @ scene.robot.mount(ring.link).axis
        for ring in setup.rings
    ]
    for view in views:
        add_base_axes(view, _AXIS)
        _number(view, result, [np.vstack([part[0] for part in ring]) for ring in parts], axes)
    return png(figure)


def _number(view: Canvas, result: PrintResult, rings: list[Any], axes: list[Any]) -> None:
    """Write each ring's number beside it, where there is room.

    Args:
        view: the view.
        result: records of the rings.
        rings: points (P, 3) m of each ring, base frame.
        axes: axis (3,) of each ring, base frame.
    """
    outlines, taken = [view.project(points)[0] for points in rings], list[Any]()
    for record, outline, axis in zip(result.rings, outlines, axes, strict=True):
        middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
        along = (view.rotation @ axis)[:2]
        across = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
        if np.linalg.norm(along) < _END_ON:
            across = np.array([1.0, 0.0])
        places, costs = [], []
        for way in (across, -across):
            edge = float(((outline - middle) @ way).max())
            for more in (0.045, 0.09, 0.135):
                at = middle + (edge + more) * way
                near = [*taken, *(o[:: max(len(o) // 60, 1)] for o in outlines)]
                least = min(float(np.linalg.norm(np.vstack([o]) - at, axis=1).min()) for o in near)
                places.append((at, middle + edge * way))
                costs.append(more - min(least, _BADGE) * 10)
        at, tip = places[int(np.argmin(costs))]
        taken.append(at[None])
        view.ax.plot(*np.transpose([tip, at]), color=_LABEL, lw=0.9)
        view.ax.text(
            *at,
            str(record.ring),
            ha="center",
            va="center",
            fontsize=11,
            color=_LABEL,
            bbox={"boxstyle": "circle,pad=0.25", "fc": "white", "ec": _LABEL, "lw": 0.9},
        )


def _side_by_side(views: list[Canvas], title: str, names: list[str]) -> Figure:
    """Return a figure of several views on one scale, as large as its page allows, with the names of
    the rings below its title."""
    extents = np.array([view.extent() for view in views])  # (V, 2, 2), m
    size = np.ptp(extents, axis=1) + 2 * _MARGIN  # (V, 2), m
    high = size[:, 1].max() + _FOOT  # room for the scale bar
    scale = min(_PAGE[0] / size[:, 0].sum(), _PAGE[1] / high)  # inches per m
    wide = size[:, 0].sum() * scale
    lines = textwrap.wrap(",  ".join(names), int(10 * wide))
    tall = high * scale + _TITLE + _LINE * len(lines)
    figure, left = Figure(figsize=(wide, tall), dpi=100, facecolor="white"), 0.0
    for view, (low, _), (width, _) in zip(views, extents, size, strict=True):
        view.ax = figure.add_axes((left, 0.0, width * scale / wide, high * scale / tall))
        view.draw(fit=False, outline=_STEP)
        x, y = low[0] - _MARGIN, low[1] - _MARGIN - _FOOT
        view.ax.set(xlim=(x, x + width), ylim=(y, y + high))
        view.ax.axis("off")
        left += width * scale / wide
    (x, y), _ = extents[0]
    add_bar(views[0], (x, y - _MARGIN), 0.2)
    figure.text(0.02, 1 - 0.15 / tall, title, va="top", fontsize=14)
    below = "\n".join(lines).replace("$", r"\$")
    figure.text(0.02, 1 - _TITLE / tall, below, va="top", fontsize=11, color=_LABEL)
    return figure
