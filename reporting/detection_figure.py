"""Figure of detection in time: shares by direction, distances, and the approaches that are reported
last.
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.base_frame import frame_text
from ..coverage.robots.robot import Robot
from ..coverage.solids.beams import Beams
from ..simulation.detection import Approaches, turned
from ..simulation.human import Bones
from ..simulation.motion_samples import STEP, Moments
from .outlines import DISC, capsule_outlines, outline
from .plots import COLOURS, GREY, GRID, INK, plain, save, sheet

SHOWN = 2  # approaches that the figure shows
_GOOD, _BAD, _PERSON, _ASKED = COLOURS[2], COLOURS[1], "#3d4650", COLOURS[4]
_ROBOT, _BEAM, _NEAR = "#9aa4ae", COLOURS[5], "#fbe6bf"
_LEAST_VIEW = 2.8  # m, the view covers at least this to both sides of the base
_GHOSTS = 0.5  # s, interval between drawn persons


def last_reported(found: Approaches) -> list[int]:
    """Return the indices of the latest of the approaches that are not reported in time.

    An approach that is never reported counts as the latest. No two differ by less than 45° in
    direction.
    """
    late = np.flatnonzero(~found.in_time)
    order = late[np.argsort(np.nan_to_num(found.report[late], nan=-1.0), kind="stable")]
    chosen: list[int] = []
    for k in order:
        apart = [abs(np.angle(np.exp(1j * (found.azimuth[k] - found.azimuth[c])))) for c in chosen]
        if all(a > np.pi / 4 for a in apart):
            chosen.append(int(k))
        if len(chosen) == SHOWN:
            break
    return chosen


def detection_figure(
    robot: Robot,
    setup: Setup,
    moments: Moments,
    found: Approaches,
    person: Bones,
    floor: float,
    sectors: int,
    file: Path,
) -> None:
    """Draw the figure.

    Args:
        robot: robot with bodies.
        setup: rings to draw.
        moments: poses of the robot over the motion.
        found: simulated approaches.
        person: skeleton of the person.
        floor: height of the floor in the base frame, m.
        sectors: number of directions over which shares are computed.
        file: PNG to write.
    """
    figure = sheet(15.5, 9.6)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.12, 1.12))
    _rose(figure.add_subplot(grid[0, 0], projection="polar"), found, sectors)
    _distances(figure.add_subplot(grid[1, 0]), found)
    worst = last_reported(found)
    for column, k in enumerate(worst, 1):
        top, side = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
        _approach(top, side, robot, setup, moments, found, k, person, floor)
    if not worst:
        ax = figure.add_subplot(grid[:, 1:])
        ax.axis("off")
        ax.text(
            0.5, 0.5, "every approach was reported in time", ha="center", fontsize=14, color=_GOOD
        )
    handles = [
        Patch(facecolor=_ROBOT, edgecolor=INK, lw=0.7, label="robot"),
        Patch(facecolor=_BEAM, alpha=0.4, label="beams at effective range"),
        Patch(facecolor=_NEAR, label="within the separation distance of a part (V_P)"),
        Line2D(
            [], [], color=_BAD, lw=3, label="the person before the first report, every half second"
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=10)
    save(figure, file)


def _rose(ax: Axes, found: Approaches, sectors: int) -> None:
    """Plot the share reported in time by direction, with its interval as a whisker."""
    sector = np.floor(np.mod(found.azimuth, 2 * np.pi) / (2 * np.pi) * sectors).astype(int)
    width = 2 * np.pi / sectors
    ax.bar(
        (np.arange(sectors) + 0.5) * width,
        100,
        width=width,
        color="#f3d9cc",
        edgecolor="white",
        lw=0.8,
    )
    for s in range(sectors):
        if not (here := sector == s).any():
            continue
        share, at = found.share(here), (s + 0.5) * width
        high = 100 * share.share
        ax.bar(at, high, width=width, color=_GOOD, edgecolor="white", lw=0.8, alpha=0.9)
        ax.plot([at, at], [100 * share.low, 100 * share.high], color=INK, lw=1.0)
    ax.set_ylim(0, 100)
    ax.set_yticks([25, 50, 75, 100], ["25", "50", "75", "100 %"], fontsize=7.5, color=GREY)
    ax.set_xticks(
        np.arange(8) * np.pi / 4,
        ["+x", "45°", "+y", "135°", "−x", "225°", "−y", "315°"],
        fontsize=8.5,
        color=GREY,
    )
    ax.grid(color=GRID, lw=0.6)
    ax.spines["polar"].set_visible(False)
    ax.set_title(
        "share reported in time, by direction of approach", fontsize=10.5, color=INK, pad=12
    )


def _distances(ax: Axes, found: Approaches) -> None:
    """Plot the distance at the first report against the distance at which a report is due."""
    report, due = np.nan_to_num(found.report, nan=0.0), np.nan_to_num(found.due, nan=0.0)
    edges = np.linspace(0, max(float(report.max()), float(due.max()), 0.1), 41)
    ax.hist(due, list(edges), color=_ASKED, alpha=0.55, label="distance at which a report is due")
    ax.hist(
        report,
        list(edges),
        color=COLOURS[0],
        alpha=0.55,
        label="distance at the first report (0: none)",
    )
    plain(ax, "distance between person and robot", "m", "approaches")
    ax.set_ylim(0, 1.25 * ax.get_ylim()[1])
    ax.legend(frameon=False, fontsize=9, loc="upper left")


def _robot(ax: Axes, m: Moments, at: int, cones: Beams, turn: float, flat: list[int]) -> None:
    """Draw the robot at moment ``at``, its separation distances, and the beams of its sensors."""
    seen = [turned(p, turn) for p in (m.start[at], m.end[at])]
    near = capsule_outlines(seen[0], seen[1], m.radius + m.required[at], flat)
    ax.add_collection(PolyCollection(near, facecolor=_NEAR, edgecolor=_NEAR, lw=0.5, zorder=0.5))
    beams = [
        outline(turned(cones.surface(i, len(DISC))[0], turn)[:, flat]) for i in range(len(cones))
    ]
    ax.add_collection(PolyCollection(beams, facecolor=_BEAM, alpha=0.16, lw=0, zorder=1))
    ax.add_collection(
        PolyCollection(beams, facecolor="none", edgecolor=_BEAM, alpha=0.5, lw=0.4, zorder=1.1)
    )
    start, end = (turned(np.asarray(ends)[at], turn) for ends in (m.bodies.start, m.bodies.end))
    links = capsule_outlines(start, end, m.bodies.radius, flat)
    ax.add_collection(PolyCollection(links, facecolor=_ROBOT, edgecolor=INK, lw=0.7, zorder=3))


def _person(ax: Axes, body: Bones, step: int, turn: float, flat: list[int]) -> None:
    """Draw the person at a step of the walk, and paler at earlier ones."""
    ghost = max(int(_GHOSTS / STEP), 1)
    for back in range(step, -1, -ghost):
        a, b = (turned(p[back], turn) for p in (body.start, body.end))
        shade = 0.75 if back == step else 0.75 * max(0.12, 0.45 - 0.12 * (step - back) / ghost)
        person = PolyCollection(
            capsule_outlines(a, b, body.radius, flat),
            facecolor=_PERSON if back == step else _BAD,
            alpha=shade,
            lw=0,
            zorder=4,
        )
        ax.add_collection(person)


def _approach(
    top: Axes,
    side: Axes,
    robot: Robot,
    setup: Setup,
    m: Moments,
    found: Approaches,
    k: int,
    body: Bones,
    floor: float,
) -> None:
    """Draw one approach at the moment a report is due, from above and from the side of the person's
    path.
    """
    azimuth, step = float(found.azimuth[k]), int(found.broken_step[k])
    at = int(m.before(int(found.moment[k]), found.walk - 1 - step))
    cones = sensor_cones(robot, setup, m.q[at])
    reported = found.report[k]
    # the side view looks across the path
    for ax, flat, turn, toward in ((top, [0, 1], 0.0, azimuth), (side, [0, 2], -azimuth, 0.0)):
        _robot(ax, m, at, cones, turn, flat)
        _person(ax, body, step, toward, flat)
        ax.set_aspect("equal")
    way = turned(body.start[:, 6], azimuth)
    top.plot(*way[: step + 1, :2].T, color=_BAD, lw=2.6, zorder=3.5, solid_capstyle="round")
    side.axhline(floor, color=INK, lw=1.2, zorder=2)
    side.axhspan(floor - 0.25, floor, color="#e4e7ea", lw=0, zorder=2)
    reach = max(float(np.hypot(*way[step, :2])) + 1.5, _LEAST_VIEW)
    top.set_xlim(-reach, reach)
    top.set_ylim(-reach, reach)
    side.set_xlim(-reach, reach)
    side.set_ylim(floor - 0.25, max(2.4, floor + 2.0))
    end = (
        "never reported before contact"
        if not np.isfinite(reported)
        else f"first reported at {100 * reported:.0f} cm"
    )
    due = f"due at {100 * found.due[k]:.0f} cm" if np.isfinite(found.due[k]) else "due at contact"
    plain(
        top,
        f"from {np.degrees(azimuth) % 360:.0f}°, at the moment a report is due\n{due}; {end}",
        f"x of {frame_text(robot)}, m",
        "y, m",
    )
    plain(side, "the same, seen across the path", "along the path, m", "z, m")
