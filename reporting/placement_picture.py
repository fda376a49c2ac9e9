"""Picture of a placement: robot, rings, covered and uncovered volume, from two sides."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import KDTree

from ..coverage.definitions.escaping import printable
from ..coverage.rings.mounted_sensor import BASE_LINK, MountedSensor
from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.base_frame import frame_text
from ..coverage.robots.built_in import PAPER_ROBOTS
from ..coverage.robots.kinematics import forward
from ..coverage.solids.beams import Beams
from ..formats.export.palette import CELL, OBSTACLE, link_colours
from ..objectives.occlusion import sight
from ..objectives.scene import Scene
from .plots import GREY, INK
from .rendering.canvas import Canvas
from .rendering.colours import UNSEEN_COLOUR, paler, rgb
from .rendering.far_side import add_far_side
from .rendering.figures import write_png
from .rendering.meshes import body, convex_pieces
from .rendering.robot import add_obstacles, add_robot, draw_room, with_obstacles
from .text import counted

# Caption, azimuth and elevation of the eye in degrees, and its distance in diagonals of the box.
VIEWS = (("oblique view", -58.0, 22.0, 4.0), ("from above", -90.0, 89.99, 1000.0))

_TARGET, _TARGET_EDGE = "#f5f5f5", "#8f8a80"
_PALE = 0.5  # share of white in the colours of the target's far side
_SAMPLES = 5_000  # points drawn in the target; the uncovered ones become dots
_SENSOR_RADIUS = 0.0085  # m
_NAME = 24  # characters of a sensor's name
_BESIDE: dict[str, Any] = {
    "xytext": (6, 0),
    "textcoords": "offset points",
    "va": "center",
    "fontsize": 9,
    "color": INK,
}


@dataclass(frozen=True)
class _Shown:
    """What the views of one setup show."""

    setup: Setup
    """The setup."""
    groups: tuple[Ring | MountedSensor, ...]
    """Its rings and single sensors, and then the sensors of the cell."""
    cones: Beams
    """Their cones."""
    uncovered: Float[np.ndarray, "N 3"]
    """Points of the target that they do not cover, m."""

    @staticmethod
    def of(scene: Scene, setup: Setup, points: Any) -> "_Shown":
        """Return what is shown of a setup in a target with these points."""
        q, whole = scene.poses[0].q, scene.with_cell(setup)
        cones = sensor_cones(scene.robot, whole, q)
        uncovered = points[sight(scene, cones, q)(points) > 0]
        return _Shown(setup, whole.groups, cones, uncovered)


def _draw_seen(
    canvas: Canvas,
    scene: Scene,
    shown: _Shown,
    colour: dict[str, str],
    pieces: list[Any],
) -> None:
    """Draw the outline of the target, of convex ``pieces``, and its far side in the colour of the
    nearest link that covers it."""
    hulls = [canvas.hull(points) for points in pieces]
    # keep the outline of the edges
    for face, edge, width in (("none", _TARGET_EDGE, 2.2), (_TARGET, _TARGET, 0.3)):
        canvas.ax.add_collection(
            PolyCollection(hulls, facecolors=face, edgecolors=edge, linewidths=width, zorder=1)
        )

    def colours(points: Any) -> Any:
        return _covering(scene, shown, colour, points)

    add_far_side(canvas, pieces, hulls, colours, zorder=1.5)


def _covering(scene: Scene, shown: _Shown, colour: dict[str, str], points: Any) -> Any:
    """Return the colours (P, 3) of points (P, 3) m: of the nearest link that covers each, or that
    of uncovered volume."""
    q, least = scene.poses[0].q, np.full(len(points), np.inf)
    result = np.tile(paler(UNSEEN_COLOUR, _PALE), (len(points), 1))
    for link in dict.fromkeys(group.link for group in shown.groups):
        some = [group for group in shown.groups if group.link == link]
        rings = tuple(group for group in some if isinstance(group, Ring))
        singles = tuple(group for group in some if not isinstance(group, Ring))
        cones = sensor_cones(scene.robot, Setup(rings, singles), q)
        away = KDTree(cones.apex).query(points)[0]
        mine = (sight(scene, cones, q)(points) <= 0) & (away < least)
        result[mine], least[mine] = paler(colour[link], _PALE), away[mine]
    return result


def _draw_robot(canvas: Canvas, scene: Scene, shown: _Shown, colour: dict[str, str]) -> None:
    """Draw robot, rings, sensors and uncovered points over the cones, with correct mutual
    occlusion.
    """
    frames, cones, unseen = (
        forward(scene.robot.chain, scene.poses[0].q),
        shown.cones,
        shown.uncovered,
    )
    # the paper's rings go around joints' axes
    bodies = scene.real or scene.robot.name not in PAPER_ROBOTS
    add_robot(canvas, scene, frames, shown.setup, colour, bodies)
    add_obstacles(canvas, scene)
    for one in scene.cell_sensors:
        at = canvas.project(np.array(one.position))[0]
        canvas.ax.annotate(printable(one.label)[:_NAME], at, **_BESIDE)
    # a little nearer than the ring they sit on
    canvas.points(cones.apex, INK, _SENSOR_RADIUS + 0.0006 * canvas.size, 0.019)
    canvas.points(cones.apex, "#ffffff", _SENSOR_RADIUS, 0.02)
    dot = (0.0022 if len(unseen) > _SAMPLES / 4 else 0.003) * canvas.size
    depth = canvas.project(unseen)[1]
    pale = np.clip(0.2 - 0.8 * depth / canvas.size, 0, 0.6)[:, None]  # with distance
    canvas.points(unseen, (1 - pale) * rgb(UNSEEN_COLOUR) + pale, dot)
    canvas.draw(fit=False, zorder=3)


def placement_picture(
    path: Path, scene: Scene, setup: Setup, zeta_lines: Sequence[str], seed: int = 0
) -> None:
    """Draw a setup in the scene's first pose, with the target of its first goal: a PNG of 1800 x
    900.

    Args:
        path: file to write; its folder exists.
        scene: scene whose first pose and first goal are drawn.
        setup: setup with at least one ring or single sensor.
        zeta_lines: the title, one text for each target, such as "V_S(0.5): 97.9 % covered".
        seed: random seed of the points that show uncovered volume.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    rings = Counter(ring.link for ring in setup.rings)
    parts = [*_where(scene), f"{setup.sensors} sensors"]
    parts += [f"{counted(n, 'ring')} on the {link.replace('_', ' ')}" for link, n in rings.items()]
    parts += [f"{len(setup.singles)} single sensors"] * bool(setup.singles)
    parts += [f"{len(scene.cell_sensors)} in the cell"] * bool(scene.cell_sensors)
    _draw(
        path,
        scene,
        [(setup, caption, *eye) for caption, *eye in VIEWS],
        "   ·   ".join(zeta_lines),
        parts,
        seed,
    )


def comparison_picture(
    path: Path,
    scene: Scene,
    before: Setup,
    after: Setup,
    captions: tuple[str, str],
    title: str,
    seed: int = 0,
) -> None:
    """Draw two setups side by side, each with its caption: a PNG like that of
    ``placement_picture``.

    Args:
        path: file to write; its folder exists.
        scene: scene whose first pose and first goal are drawn.
        before: setup on the left.
        after: setup on the right.
        captions: their captions.
        title: title of the picture.
        seed: random seed of the points that show uncovered volume.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    views = [
        (setup, caption, *VIEWS[0][1:])
        for setup, caption in zip((before, after), captions, strict=True)
    ]
    _draw(path, scene, views, title, _where(scene), seed)


def _where(scene: Scene) -> list[str]:
    return [scene.robot.name, *([f"pose 0 of {len(scene.poses)}"] * (len(scene.poses) > 1))]


def _draw(
    path: Path, scene: Scene, views: list[Any], title: str, parts: list[str], seed: int
) -> None:
    """Draw two views under a title and a line of ``parts``.

    Args:
        path: file to write.
        scene: scene whose first pose and first goal are drawn.
        views: setup, caption, and the eye's azimuth, elevation and distance for each view.
        title: title of the picture.
        parts: parts of the line below the title.
        seed: random seed of the points that show uncovered volume.
    """
    robot, q, target = scene.robot, scene.poses[0].q, scene.targets[0].target
    solid, points = scene.solid(target, 0), scene.sample(target, 0, _SAMPLES, seed)
    pieces = convex_pieces(solid.a)
    each = {one: _Shown.of(scene, one, points) for one, *_ in views}
    apexes = [one.cones.apex for one in each.values()]
    corners = np.vstack([*pieces, body(robot, forward(robot.chain, q)), *apexes])
    box = np.stack([corners.min(axis=0) - 0.05, corners.max(axis=0) + 0.05])
    box = with_obstacles(box, scene)
    links = list(dict.fromkeys(group.link for one in each.values() for group in one.groups))
    colour = link_colours(list(dict.fromkeys((*robot.links, *links)))) | {BASE_LINK: CELL}
    figure = Figure(figsize=(12, 6), dpi=150, facecolor="white")
    for left, (setup, caption, *eye) in zip((0.01, 0.51), views, strict=True):
        canvas = Canvas(_axes(figure, left), box, *eye)
        draw_room(canvas)
        _draw_seen(canvas, scene, each[setup], colour, pieces)
        _draw_robot(canvas, scene, each[setup], colour)
        ax = canvas.ax
        ax.axis("off")
        caption += f" · axes of {frame_text(robot)}"
        ax.text(0, 1.01, caption, transform=ax.transAxes, fontsize=12.5, color=GREY, style="italic")
    size = min(18, 1300 / max(1, len(title)))
    figure.text(0.5, 0.945, title, ha="center", fontsize=size, color=INK, weight="bold")
    figure.text(0.5, 0.9, "  ·  ".join(parts), ha="center", fontsize=12.5, color=GREY)
    _add_key(figure, scene, {link: colour[link] for link in links})
    write_png(path, figure)


def _axes(figure: Figure, left: float) -> Axes:
    """Return axes for a view, in metres, whose left edge is at this share of the figure's width."""
    return figure.add_axes(
        (left, 0.085, 0.48, 0.765),
        aspect="equal",
        xmargin=0.01,
        ymargin=0.01,
        xticks=(),
        yticks=(),
    )


def _add_key(figure: Figure, scene: Scene, colour: dict[str, str]) -> None:
    """Add the key of colours at the bottom of a figure, smaller if it is too wide."""

    def covered(link: str) -> str:
        return f"covered from the {'cell' if link == BASE_LINK else link.replace('_', ' ')}"

    target = scene.targets[0].target
    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 5, "color": UNSEEN_COLOUR}
    key = [
        *(Patch(fc=paler(c, _PALE), ec=c, label=covered(link)) for link, c in colour.items()),
        Line2D([], [], label=f"uncovered: {target}", **dot),
        Patch(fc="white", ec=_TARGET_EDGE, label="far side of the target"),
        *([Patch(fc=OBSTACLE, label="obstacles")] if scene.obstacles else []),
    ]
    plain: dict[str, Any] = {
        "handles": key,
        "loc": "lower center",
        "ncols": len(key),
        "frameon": False,
    }
    legend = figure.legend(**plain, fontsize=11.5)
    room = 0.97 * figure.bbox.width / legend.get_window_extent().width
    if room < 1:
        legend.remove()
        figure.legend(**plain, fontsize=11.5 * room)
