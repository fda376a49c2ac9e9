"""Mounting drawing of the rings on a link: a side view with the distance of each ring from the end
of the mount, and the angles of the sensors of each ring, seen from the tool.
"""

import math
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.ring_section import surrounded
from ...coverage.robots.robot import Mount
from ...formats.export.palette import link_colours
from ...objectives.scene import Scene
from ..plots import COLOURS, GREY, GRID, INK
from ..rendering.colours import rgb
from ..rendering.figures import write_png
from .directions import axis_name

_WIDE = 8.6  # inches
_SIDE, _STEP = 1.9, 0.22  # inches: height of the side view, and of a dimension line
_DIALS, _DIAL, _CAPTION = 6, 1.4, 0.72  # dials in a row; their height and that of their captions
_TITLE = 0.4  # inches
_LINK_FACE, _FIRST = "#dfe3e8", COLOURS[1]
_BEAM = 0.45  # length of a drawn beam, as a share of the largest radius
_SMALLEST = 0.02  # m, radius of a link of unknown section
_MM = 1000.0


def drawing_name(number: int) -> str:
    """Return the file name of the drawing of a link."""
    return f"mounting_{number}.png"


def ringed_links(setup: Setup) -> dict[str, list[int]]:
    """Return the numbers of the rings of each link that carries one."""
    links: dict[str, list[int]] = {}
    for number, ring in enumerate(setup.rings):
        links.setdefault(ring.link, []).append(number)
    return links


def mounting_drawing(path: Path, scene: Scene, setup: Setup, link: str) -> None:
    """Draw the rings of a link with their dimensions.

    Args:
        path: file to write, PNG.
        scene: the scene.
        setup: the setup.
        link: link that carries at least one ring.

    Raises:
        UserError: if the file cannot be written.
    """
    numbers, mount = ringed_links(setup)[link], scene.robot.mount(link)
    rings = {n: setup.rings[n] for n in numbers}
    lines = len(rings) + 1 if mount.length > 0 else 0
    side = _SIDE + _STEP * lines if mount.length > 0 else 0.0
    rows = math.ceil(len(rings) / _DIALS)
    tall = _TITLE + side + rows * (_DIAL + _CAPTION)
    figure = Figure(figsize=(_WIDE, tall), dpi=150, facecolor="white")
    name, colour = link.replace("_", " "), link_colours(scene.robot.links)[link]
    figure.text(0.012, 1 - 0.3 / tall, f"Rings on the {name}", fontsize=13, color=INK, va="center")
    if mount.length > 0:
        area = (0.03, (tall - _TITLE - side) / tall, 0.94, side / tall)
        _side_view(figure.add_axes(area), scene, mount, rings, colour)
    for k, (number, ring) in enumerate(rings.items()):
        row, column = divmod(k, _DIALS)
        top = tall - _TITLE - side - row * (_DIAL + _CAPTION)
        left = column / _DIALS * 0.98 + 0.01
        area = (left, (top - _DIAL) / tall, 0.98 / _DIALS, _DIAL / tall)
        _dial(figure.add_axes(area), mount, number, ring, surrounded(scene.robot, link), colour)
    write_png(path, figure)


def _side_view(ax: Any, scene: Scene, mount: Mount, rings: dict[int, Ring], colour: str) -> None:
    """Draw the link from the side, proximal end on the left, with its rings and dimensions, mm."""
    long, section = _MM * mount.length, _MM * max(surrounded(scene.robot, mount.link), _SMALLEST)
    largest = _MM * max(ring.radius for ring in rings.values())
    half = 0.009 * long
    left, right = -0.2 * long, 1.12 * long
    inch = (right - left) / (0.94 * _WIDE)  # mm in an inch
    bottom = -_SIDE / 2 * inch - _STEP * (len(rings) + 1) * inch
    scale = min(1.0, 0.45 * _SIDE / 2 * inch / largest)  # across the link, to fit
    ax.set(xlim=(left, right), ylim=(bottom, _SIDE / 2 * inch))
    ax.axis("off")
    low, high = -scale * section, scale * section
    ax.add_patch(Rectangle((0, low), long, high - low, fc=_LINK_FACE, ec=GREY, lw=1.0))
    ax.plot((left, right), (0, 0), color=GREY, lw=0.7, ls=(0, (9, 3, 2, 3)))
    for x, text, side in ((0.0, "proximal", "right"), (long, "distal", "left")):
        away = -0.1 * inch if side == "right" else 0.1 * inch
        ax.text(x + away, high * 0.55, text, ha=side, va="center", fontsize=8.5, color=GREY)
    order = sorted(rings, key=lambda n: rings[n].position)
    for level, number in enumerate(order, start=1):
        ring = rings[number]
        x, r = long * ring.position, scale * _MM * ring.radius
        _ring(ax, x, r, half, ring.tilt, _BEAM * scale * largest, colour)
        top = scale * largest * (1 + _BEAM) + (0.03 + 0.16 * (level % 2)) * inch
        ax.text(x, top, str(number), ha="center", va="bottom", fontsize=9, color=INK, weight="bold")
        y = -_SIDE / 2 * inch - (level - 0.5) * _STEP * inch
        _dimension(ax, x, y, -r, f"ring {number}: {x:.1f} mm")
    y = -_SIDE / 2 * inch - (len(order) + 0.5) * _STEP * inch
    _dimension(ax, long, y, low, f"mount: {long:.1f} mm")
    ax.plot((0, 0), (low, y), color=GRID, lw=0.8, zorder=0)


def _ring(
    ax: Any, x: float, radius: float, half: float, tilt: float, beam: float, colour: str
) -> None:
    """Draw a ring from the side, with a beam above and below it."""
    corner, edge = (x - half, -radius), tuple(0.8 * rgb(colour))
    ax.add_patch(Rectangle(corner, 2 * half, 2 * radius, fc=colour, ec=edge, lw=0.8))
    for sign in (-1.0, 1.0):
        tip = (x + beam * math.sin(tilt), sign * (radius + beam * math.cos(tilt)))
        arrow = {"arrowstyle": "-|>", "color": _FIRST, "lw": 1.0, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tip, (x, sign * radius), arrowprops=arrow)


def _dimension(ax: Any, x: float, y: float, start: float, text: str) -> None:
    """Draw a dimension from the proximal end to ``x`` at height ``y``, its line from ``start``."""
    ax.plot((x, x), (start, y), color=GRID, lw=0.8, zorder=0)
    arrow = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (x, y), (0, y), arrowprops=arrow)
    box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
    ax.text(0, y, text, ha="right", va="center", fontsize=8.5, color=INK, bbox=box)


def _dial(ax: Any, mount: Mount, number: int, ring: Ring, section: float, colour: str) -> None:
    """Draw the sensors of a ring about its link, seen from the distal end."""
    ax.add_patch(Circle((0, 0), max(section, _SMALLEST) / ring.radius, fc=_LINK_FACE, ec=GREY))
    ax.add_patch(Circle((0, 0), 1.0, fc="none", ec=tuple(0.8 * rgb(colour)), lw=1.6))
    ax.plot((0, 1.62), (0, 0), color=GREY, lw=0.9, ls=(0, (5, 3)))
    ax.text(1.66, 0, axis_name(mount.zero), fontsize=8.5, color=GREY, va="center")
    size = 7.0 if ring.count <= 16 else 5.0
    for k in range(ring.count):
        angle = ring.phase + k * math.tau / ring.count
        c, s = math.cos(angle), math.sin(angle)
        ink = _FIRST if k == 0 else INK
        ax.plot((c, 1.14 * c), (s, 1.14 * s), color=ink, lw=2.4 if k == 0 else 1.4)
        ax.plot(c, s, "o", ms=5 if k == 0 else 3, color=ink)
        weight = "bold" if k == 0 else "normal"
        style: dict[str, Any] = {"ha": "center", "va": "center", "color": ink, "weight": weight}
        style |= {"bbox": {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none"}}
        ax.text(1.33 * c, 1.33 * s, str(k), fontsize=size + (k == 0), **style)
    phase = round(math.degrees(ring.phase), 2) % 360
    lines = (
        f"ring {number}: {ring.count} sensors",
        f"sensor 0 at {phase:.2f}°",
        f"then every {360 / max(ring.count, 1):.2f}°",
        f"tilt {math.degrees(ring.tilt) + 0.0:+.2f}°",
    )
    ax.text(0.15, -1.55, "\n".join(lines), ha="center", va="top", fontsize=8, color=INK)
    ax.set(xlim=(-1.75, 2.05), ylim=(-1.6, 1.6), aspect="equal")
    ax.axis("off")
    ax.set_clip_on(False)
