"""Section of a report on blind spots: the largest balls that no sensor covers."""

from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...coverage.arrays import Array
from ...coverage.rings.ring import Setup
from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.kinematics import forward
from ...coverage.voxels.inscribed_balls import coarser
from ...coverage.voxels.voxel_set import VoxelSet
from ...objectives.blind_spots import LEAST, Blind, BlindSpot
from ...objectives.scene import Scene
from ..pages import table
from ..placement_picture import VIEWS
from ..plots import COLOURS, GREY, INK
from ..rendering.canvas import Canvas
from ..rendering.figures import write_png
from ..rendering.meshes import ball, body, closed
from ..rendering.robot import add_obstacles, add_robot, draw_room, with_obstacles
from ..rendering.voxels import add_skin, skin, voxel_set
from ..text import listed
from .directions import height, metres, whereabouts
from .facts import Facts


def blind_name(number: int) -> str:
    """Return the file name of the picture of a target's blind spots."""
    return f"blind_{number}.png"


def blind_sentence(blind: Blind) -> str:
    """Return the largest blind spot in one sentence, or that there is none."""
    if not blind.spots:
        return (
            f"No ball of {200 * LEAST:.0f} cm or more across fits into the uncovered part of"
            f" {blind.target}"
        )
    spot = blind.spots[0]
    return (
        f"The largest ball in {blind.target} that no sensor covers is {2 * spot.radius:.2f} m"
        f" across: {whereabouts(spot)}, {height(spot)}"
    )


def blind_spot_section(f: Facts) -> Iterator[str]:
    """Yield the section's paragraphs and tables, as Markdown."""
    yield "## Blind spots\n"
    several = len(f.scene.poses) > 1
    yield (
        "A blind spot is a ball that lies wholly in the target and that no sensor covers: a thing"
        " of that size can be there unnoticed. The balls do not overlap; each is the largest that"
        f" fits beside those before it, right to a few voxels of {100 * f.voxel:g} cm."
        f" Balls less than {200 * LEAST:.0f} cm across are not listed. The front is the side of the"
        " base to which the tool points; left and right are those of the robot. Heights count from"
        " the base frame's origin.\n"
    )
    if f.scene.person is not None:
        yield "Only what a person can touch counts here, by the scene's `person`.\n"
    for n, blind in enumerate(f.blind):
        if len(f.blind) > 1:
            yield f"### {blind.target}\n"
        amounts = [
            f"{f'pose {p}: ' if several else ''}{1000 * v:,.1f} litres"
            for p, v in zip(blind.poses, blind.volume, strict=True)
        ]
        yield f"Uncovered under `{f.scene.occlusion}`: {'; '.join(amounts)}.\n"
        if not blind.spots:
            yield f"{blind_sentence(blind)}.\n"
            continue
        yield (
            f"![The largest uncovered balls of {blind.target} beside the robot, from two"
            f" sides]({blind_name(n)})\n"
        )
        yield table(*_spots(blind, several), right=(0, 1))


def _spots(blind: Blind, several: bool) -> tuple[list[str], list[list[str]]]:
    rows = []
    for i, spot in enumerate(blind.spots):
        gap = spot.beside.gap - spot.radius
        near = "touches it" if gap <= blind.voxel else f"{gap:.2f} m"
        row = [
            str(i + 1),
            f"{2 * spot.radius:.2f}",
            whereabouts(spot),
            height(spot),
            near,
        ]
        row += [metres(spot.centre)]
        rows.append(row + ([listed([str(p) for p in spot.poses])] if several else []))
    heads = ["", "diameter, m", "where", "height", "gap to the robot", "centre x, y, z, m"]
    return heads + (["in poses"] if several else []), rows


_MOST = 30_000  # largest number of voxels drawn
_FACES = 24  # corners of a circle of a drawn ball
_FAINT, _FAINT_ALPHA = "#8a8f96", 0.06  # of the whole uncovered part
_COLOURS = (*COLOURS[:-1], "#8a6642", "#5b5ea6")
_RINGS = "#4a525a"


def coarse(voxels: VoxelSet, most: int = _MOST) -> VoxelSet:
    """Resample a set to at most about ``most`` voxels of the smallest sufficient size.

    A coarse voxel is kept if at least half of it belongs to the set.
    """
    level = max(0, int(np.ceil(np.log2(max(len(voxels), 1) / most) / 3)))
    if level == 0:
        return voxels
    return voxel_set(voxels.voxel * (1 << level), coarser(voxels, level, 0.5))


def blind_picture(path: Path, scene: Scene, setup: Setup, blind: Blind) -> None:
    """Draw the blind spots at the pose of the largest one, with their numbers: a PNG of 1800 x 900.

    The whole uncovered part of the target is faint behind them.

    Args:
        path: file to write.
        scene: scene of the setup.
        setup: rings to draw.
        blind: blind spots of one target, largest first, at least one.

    Raises:
        UserError: if the file cannot be written.
    """
    pose = blind.spots[0].pose
    spots = {i: spot for i, spot in enumerate(blind.spots) if spot.pose == pose}
    frames = forward(scene.robot.chain, scene.poses[pose].q)
    box = scene.solid(blind.target, pose).a.bounds()
    line = body(scene.robot, frames)
    box = np.stack([np.minimum(box[0], line.min(axis=0)), np.maximum(box[1], line.max(axis=0))])
    box = with_obstacles(box, scene)
    colours = dict(zip(spots, cycle(_COLOURS), strict=False))
    figure = Figure(figsize=(12, 6), dpi=150, facecolor="white")
    for left, (caption, azimuth, elevation, _) in zip((0.01, 0.51), VIEWS, strict=True):
        axes = figure.add_axes((left, 0.085, 0.48, 0.765), aspect="equal")
        canvas = Canvas(axes, box, azimuth, elevation)
        _draw_cell(canvas, scene, setup, frames)
        surface = skin(coarse(blind.uncovered), canvas.rotation[2])
        add_skin(canvas, surface, _FAINT, alpha=_FAINT_ALPHA)
        _draw_spots(canvas, spots, colours)
        canvas.ax.axis("off")
        caption += f" · axes of {frame_text(scene.robot)}"
        canvas.ax.text(
            0, 1.01, caption, transform=canvas.ax.transAxes, fontsize=11, color=GREY, style="italic"
        )
    at = f", pose {pose}" if len(scene.poses) > 1 else ""
    several = "largest balls" if len(spots) > 1 else "largest ball"
    title = f"The {several} of {blind.target} that no sensor covers{at}"
    figure.text(0.5, 0.945, title, ha="center", fontsize=16, color=INK, weight="bold")
    key = [
        Patch(fc=colours[i], label=f"{i + 1}: ⌀ {2 * spot.radius:.2f} m")
        for i, spot in spots.items()
    ]
    key.append(Patch(fc=_FAINT, alpha=0.3, label="uncovered"))
    figure.legend(handles=key, loc="lower center", ncols=5, frameon=False, fontsize=11)
    write_png(path, figure)


def _draw_cell(canvas: Canvas, scene: Scene, setup: Setup, frames: Array) -> None:
    """Draw floor, obstacles and the robot with its rings at ``frames``."""
    draw_room(canvas)
    add_obstacles(canvas, scene)
    rings = dict.fromkeys(scene.robot.links, _RINGS)
    add_robot(canvas, scene, frames, setup, rings, bool(scene.robot.bodies))


def _draw_spots(canvas: Canvas, spots: dict[int, BlindSpot], colours: dict[int, str]) -> None:
    """Draw blind spots, and their numbers on top of everything."""
    for i, spot in spots.items():
        surface = closed(ball(spot.centre, spot.radius, _FACES))
        canvas.mesh(surface, colours[i], alpha=0.75, closed=True)
    canvas.draw()
    for i, spot in spots.items():
        x, y = canvas.project(spot.centre)[0]
        tag = {
            "boxstyle": "circle,pad=0.25",
            "facecolor": "white",
            "edgecolor": colours[i],
            "linewidth": 1.6,
        }
        canvas.ax.text(
            x,
            y,
            str(i + 1),
            color=INK,
            fontsize=10,
            ha="center",
            va="center",
            bbox=tag,
            zorder=6,
        )
