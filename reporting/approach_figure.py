"""Figure of undetected approaches: robot, beams and paths from above and from the side, with
clearances.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import ConvexHull

from ..coverage.arrays import Array
from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import Robot
from ..coverage.solids.capsules import Capsules, gap_to_capsules
from ..coverage.solids.cones import Cones
from ..simulation.approach import Approach
from ..simulation.detection import turned
from ..simulation.human import PEDESTAL
from .plots import COLOURS, GREY, INK, plain, save, sheet

_DISC = np.stack(
    [f(np.linspace(0, 2 * np.pi, 40, endpoint=False)) for f in (np.cos, np.sin)], axis=1
)
_BEAM, _PALE, _ROBOT = COLOURS[5], "#dceefa", "#9aa4ae"
_EVERY = 0.1  # m, distance between drawn balls along a path


def _outline(points: Float[np.ndarray, "P 2"]) -> Float[np.ndarray, "Q 2"]:
    """Return the corners of the convex hull of points on two axes."""
    corners: np.ndarray = points[ConvexHull(points).vertices]
    return corners


def _beam(cones: Cones, i: int) -> Float[np.ndarray, "P 3"]:
    """Return points (P, 3) m whose convex hull is a cone: its apex and the circle of its base."""
    axis = cones.axis[i]
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    circle = (
        cones.range_m[i] * np.tan(cones.half_angle[i]) * (_DISC @ np.stack([u, np.cross(axis, u)]))
    )
    return np.vstack([cones.apex[i], cones.apex[i] + cones.range_m[i] * axis + circle])


def beam_outline(cones: Cones, i: int, turn: float, flat: list[int]) -> Float[np.ndarray, "P 2"]:
    """Return the outline of one cone in a projection.

    Args:
        cones: beams.
        i: index of the cone.
        turn: angle by which everything is first rotated about z, rad.
        flat: indices of the two axes to project on.
    """
    return _outline(turned(_beam(cones, i), turn)[:, flat])


def robot_outlines(bodies: Capsules, at: int, turn: float, flat: list[int]) -> list[np.ndarray]:
    """Return the outlines of the robot's bodies in a projection.

    Args:
        bodies: capsules with a leading axis of poses.
        at: index of the pose.
        turn: angle by which everything is first rotated about z, rad.
        flat: indices of the two axes to project on.
    """
    start, end = (turned(np.asarray(ends)[at], turn) for ends in (bodies.start, bodies.end))
    return capsule_outlines(start, end, bodies.radius, flat)


def capsule_outlines(
    start: Float[Array, "N 3"],
    end: Float[Array, "N 3"],
    radius: Float[Array, " N"],
    flat: list[int],
) -> list[np.ndarray]:
    """Return the outlines of capsules in a projection.

    Args:
        start: first ends (N, 3) m.
        end: second ends (N, 3) m.
        radius: radii (N,) m.
        flat: indices of the two axes to project on.
    """
    each = zip(start, end, radius, strict=True)
    return [_outline(np.vstack([p[flat] + r * _DISC for p in (a, b)])) for a, b, r in each]


def _view(
    ax: Axes, cones: Cones, bodies: Capsules, approaches: list[Approach], plane: tuple[int, int]
) -> None:
    """Draw beams, robot, floor and paths, projected on the plane of two axes."""
    flat = list(plane)
    beams = [_outline(_beam(cones, i)[:, flat]) for i in range(len(cones))]
    # the fills hide all edges but those of the union
    ax.add_collection(PolyCollection(beams, facecolor="none", edgecolor=_BEAM, lw=1.6, zorder=0.5))
    ax.add_collection(PolyCollection(beams, facecolor=_PALE, lw=0, zorder=0.6))
    links = capsule_outlines(*bodies.arrays(), flat)
    ax.add_collection(PolyCollection(links, facecolor=_ROBOT, edgecolor=INK, lw=0.7, zorder=3))
    for k, found in enumerate(approaches):
        line = _along(found.path)[:, flat]
        size = np.full(len(line[::2]), 2 * found.radius)
        balls = EllipseCollection(
            size,
            size,
            np.zeros(len(size)),
            units="xy",
            offsets=line[::2],
            offset_transform=ax.transData,
        )
        balls.set(facecolor=_colour(k), alpha=0.22, edgecolor=_colour(k), lw=0.6, zorder=4)
        ax.add_collection(balls)
        ax.plot(*line.T, color=_colour(k), lw=1.8, zorder=5)
        ax.plot(*line[-1], "o", color=_colour(k), ms=5, mec="white", mew=0.7, zorder=6)
    if 2 in plane:
        ax.axhline(-PEDESTAL, color=INK, lw=1.2, zorder=2)
        ax.fill_between(
            [0, 1],
            -PEDESTAL - 0.2,
            -PEDESTAL,
            transform=ax.get_yaxis_transform(),
            color="#e4e7ea",
            lw=0,
            zorder=2,
        )
    ax.set_aspect("equal")


def _along(path: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, "N 3"]:
    """Resample a path at even steps, including both ends."""
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    at = np.linspace(0, length[-1], max(2, round(length[-1] / (_EVERY / 2))) + 1)
    return np.stack([np.interp(at, length, x) for x in path.T], axis=1)


def _colour(k: int) -> str:
    return (COLOURS[1], COLOURS[3], COLOURS[2])[k % 3]


def picture(
    robot: Robot,
    setups: dict[str, Setup],
    q: Float[np.ndarray, " J"],
    found: dict[str, list[Approach]],
    file: Path,
) -> None:
    """Draw one row for each setup: the view from above, the view from the side, and the ball's
    clearance along its path.

    Args:
        robot: robot with bodies.
        setups: setups by the name to print on the row.
        q: pose (J,) rad.
        found: approaches to draw for each setup, by the same names.
        file: PNG to write.
    """
    bodies = robot_capsules(robot, forward(robot.chain, q))
    figure = sheet(14.5, 0.6 + 4.3 * len(setups))
    axes = figure.subplots(len(setups), 3, squeeze=False, width_ratios=(1, 1, 0.85))
    spots = np.concatenate([_along(one.path) for many in found.values() for one in many])
    spots = np.vstack(
        [spots, *(sensor_cones(robot, setup, q).bounds() for setup in setups.values())]
    )
    low, high = spots.min(axis=0) - 0.1, spots.max(axis=0) + 0.1
    low[2] = -PEDESTAL - 0.15
    high[1:] = low[1:] + (high - low)[1:].max()  # both views have the same height
    for (top, side, clear), (name, setup) in zip(axes, setups.items(), strict=True):
        cones = sensor_cones(robot, setup, q)
        _view(top, cones, bodies, found[name], (0, 1))
        _view(side, cones, bodies, found[name], (0, 2))
        for ax, up in ((top, 1), (side, 2)):
            ax.set_xlim(low[0], high[0])
            ax.set_ylim(low[up], high[up])
        plain(top, f"{name}, from above", "x, m", "y, m")
        plain(side, f"{name}, from the side", "x, m", "z, m")
        for k, one in enumerate(found[name]):
            line = _along(one.path)
            left = np.linalg.norm(np.diff(line, axis=0), axis=1)
            left = np.append(np.cumsum(left[::-1])[::-1], 0)
            gap = gap_to_capsules(line, bodies.start, bodies.end, bodies.radius) - one.radius
            label = f"ball of {200 * one.radius:g} cm: ends {100 * one.gap_m:.0f} cm from the arm"
            clear.plot(left, gap, color=_colour(k), lw=1.8, label=label)
            clear.plot(left, cones(line) - one.radius, color=_colour(k), lw=1.2, ls=(0, (4, 2)))
        plain(
            clear, "clearance along the path", "distance to the end of the path, m", "clearance, m"
        )
        clear.invert_xaxis()
        clear.set_ylim(0, 2.3)
        clear.legend(loc="upper right", fontsize=9, frameon=False)
    handles = [
        Patch(facecolor=_ROBOT, edgecolor=INK, lw=0.7, label="robot"),
        Patch(facecolor=_PALE, edgecolor=_BEAM, label="all beams, projected"),
        Line2D([], [], color=COLOURS[1], lw=1.8, label="path of the small ball"),
        Line2D([], [], color=COLOURS[3], lw=1.8, label="path of the large ball"),
        Line2D([], [], color=GREY, lw=1.8, label="clearance from the robot"),
        Line2D(
            [],
            [],
            color=GREY,
            lw=1.2,
            ls=(0, (4, 2)),
            label="lower bound on the clearance from every beam",
        ),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=6, frameon=False, fontsize=10)
    save(figure, file)
