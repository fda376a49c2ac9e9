"""Octree pictures: volumes of a setup as voxels, and shells of several radii."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...objectives.scene import CoreScene
from ...reporting.plots import GREY
from ...reporting.rendering.colours import UNSEEN_COLOUR, paler
from ...reporting.rendering.figures import write_png
from .octree_panels import add_head, add_title, fit_panels, panel_axes
from .octree_view import (
    SHELL_COLOUR,
    OctreeView,
    canvas_of,
    draw_both,
    draw_cones,
    draw_discs,
    draw_left,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _key(figure: "Figure", view: OctreeView, *more: tuple[Any, str]) -> None:
    """Draw the legend of the voxels' colours below the panels."""
    from matplotlib.patches import Patch

    seen = [
        (view.colours[link], f"covered from the {link.replace('_', ' ')}")
        for link in dict.fromkeys(view.links)
    ]
    patches = [
        Patch(fc=colour, label=label)
        for colour, label in (*seen, (SHELL_COLOUR, "V_S, uncovered"), *more)
    ]
    figure.legend(
        handles=patches,
        loc="lower center",
        ncols=len(patches),
        frameon=False,
        fontsize=9.5,
        columnspacing=1.4,
    )


def four_panels(
    file: Path, scene: CoreScene, setup_name: str, radius: float, voxel: float
) -> dict[str, float]:
    """Draw V_S as it is swept, V_FOV, the voxels of both, and the uncovered voxels of V_S.

    Args:
        file: PNG to write; its folder exists.
        scene: scene whose first pose is drawn.
        setup_name: name such as n2_16_25.
        radius: radius of V_S, m.
        voxel: side of the voxels, which count by their centres, m.

    Returns:
        The drawn numbers: radius, voxel, shell_voxels, fov_voxels, covered_voxels, left_voxels,
            shell_m3, fov_m3 and zeta_percent.
    """
    view = OctreeView.of(scene, setup_name, radius, voxel)
    found = view.numbers()
    figure, axes = panel_axes(
        (10, 9.7), 2, 2, left=0.02, right=0.98, bottom=0.045, top=0.865, hspace=0.14, wspace=0.06
    )
    counts = f"{found['shell_voxels']:,} and {found['fov_voxels']:,} voxels of {100 * voxel:g} cm"
    optics = (
        f"{view.setup.sensors} cones of {np.degrees(scene.sensor.fov):g}°,"
        f" {scene.sensor.range_m:g} m"
    )
    drawings = (
        (draw_discs, "(a)  V_S", "swept discs: bends grey, straight parts coloured"),
        (draw_cones, "(b)  V_FOV", f"{optics}; outlines only towards the eye"),
        (draw_both, "(c)  Ω(V_S) and Ω(V_FOV), cut open", f"{counts}; pale: outside V_S"),
        (
            draw_left,
            "(d)  Ω(V_S) − Ω(V_FOV), cut open",
            f"{found['left_voxels']:,} voxels, {found['left_m3']:.2f} m³",
        ),
    )
    canvases = [canvas_of(ax, view) for ax in axes]
    for canvas, (draw, name, text) in zip(canvases, drawings, strict=True):
        draw(canvas, view)
        add_title(canvas.ax, name, text)
    fit_panels(canvases, alike=False)
    share = (
        f"{found['covered_voxels']:,} of {found['shell_voxels']:,} voxels covered: ζ ="
        f" {found['zeta_percent']:.1f} %"
    )
    add_head(figure, f"{setup_name}, shell V_S of {radius:g} m", share)
    _key(figure, view, (UNSEEN_COLOUR, "uncovered (d)"))
    write_png(file, figure)
    return found


def shells(
    file: Path, scene: CoreScene, setup_name: str, radii: tuple[float, ...], voxel: float
) -> list[dict[str, float]]:
    """Draw the voxels of V_S and V_FOV, cut open, for shells of several radii at one scale.

    Args:
        file: PNG to write; its folder exists.
        scene: scene whose first pose is drawn.
        setup_name: name such as n2_16_25.
        radii: radii of V_S, m.
        voxel: side of the voxels, m.

    Returns:
        The numbers of each shell; see ``four_panels``.
    """
    views = [OctreeView.of(scene, setup_name, radius, voxel) for radius in radii]
    found = [view.numbers() for view in views]
    width = 0.15 + 4.1 * len(radii)
    figure, axes = panel_axes(
        (width, 5.1), 1, len(radii), left=0.01, right=0.99, bottom=0.07, top=0.75, wspace=0.04
    )
    canvases = [canvas_of(ax, view) for ax, view in zip(axes, views, strict=True)]
    for letter, canvas, view, shown in zip("abcdefgh", canvases, views, found, strict=False):
        draw_both(canvas, view)
        share = (
            f"{shown['covered_voxels']:,} of {shown['shell_voxels']:,} voxels covered: ζ ="
            f" {shown['zeta_percent']:.1f} %"
        )
        add_title(canvas.ax, f"({letter})  r_S = {shown['radius']:g} m", share)
    fit_panels(canvases, alike=True)
    add_head(
        figure,
        f"{setup_name}, shells V_S of several radii",
        f"voxels of {100 * voxel:g} cm, cut open",
    )
    _key(figure, views[0], (paler(GREY, 0.55), "paler: covered, outside V_S"))
    write_png(file, figure)
    return found
