"""Octree pictures: volumes of a setup as voxels, shells of several radii, and one cone."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.solids.cones import Cones
from ...coverage.voxels.octree import Rule, count, voxels
from ...objectives.scene import Scene
from ...reporting.plots import GREY, INK
from ...reporting.rendering.canvas import Canvas
from ...reporting.rendering.colours import UNSEEN_COLOUR, paler
from ...reporting.rendering.figures import add_axes, add_bar, write_png
from ...reporting.rendering.meshes import circle, cone, loops
from ...reporting.rendering.voxels import add_skin, normals, skin
from .octree_view import (
    EYE,
    SHELL_COLOUR,
    OctreeView,
    canvas_of,
    draw_both,
    draw_cones,
    draw_discs,
    draw_left,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CONE_VOXELS = (0.2, 0.1, 0.05, 0.025)  # m
PAPER_CONE, PAPER_OCTREE = 0.173, 0.17  # m^3, the paper's cone by formula and by octree
_RULES: dict[Rule, tuple[str, str]] = {
    "centre": ("#0072B2", "its centre is inside"),
    "touch": ("#D55E00", "any part is inside"),
}
# m, offset from the lattice on each axis: an apex on the lattice touches extra voxels
_OFF = CONE_VOXELS[-1] / 3
_APEX, _AXIS = np.full(3, _OFF), np.array([0.0, 0.0, 1.0])  # of the paper's cone
PLACES = 100  # positions of a cone on the lattice, over which a volume is averaged
_DISCS, _METAL = 0.1, "#aab3bc"  # m, distance between the discs of a cone; their colour
_DPI = 150


def _axes(
    size: tuple[float, float], rows: int, columns: int, **space: float
) -> "tuple[Figure, list[Axes]]":
    """Return a figure of ``size`` inches and its axes, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=_DPI, facecolor="white")
    axes = figure.subplots(rows, columns, squeeze=False, gridspec_kw=space)
    for ax in axes.flat:
        ax.axis("off")
    return figure, list(axes.flat)


def _head(figure: "Figure", title: str, text: str) -> None:
    height = figure.get_size_inches()[1]
    figure.text(
        0.5, 1 - 0.2 / height, title, fontsize=15, color=INK, weight="bold", ha="center", va="top"
    )
    figure.text(0.5, 1 - 0.52 / height, text, fontsize=10.5, color=GREY, ha="center", va="top")


def _title(ax: "Axes", name: str, text: str) -> None:
    for words, up, size, colour, weight in (
        (text, 3, 9.5, GREY, "normal"),
        (name, 3 + 11.8 * (1 + text.count("\n")), 12, INK, "bold"),
    ):
        place: dict[str, Any] = {
            "xycoords": "axes fraction",
            "xytext": (0, up),
            "textcoords": "offset points",
            "va": "bottom",
        }
        ax.annotate(words, (0, 1), fontsize=size, color=colour, weight=weight, **place)


def _fit(canvases: Sequence[Canvas], alike: bool) -> None:
    """Zoom to the drawings, equally on all canvases if ``alike``, and draw scales and axes
    below.
    """
    limits = np.array([(s.ax.dataLim.min, s.ax.dataLim.max) for s in canvases])
    if alike:
        limits[:] = limits[:, 0].min(axis=0), limits[:, 1].max(axis=0)
    for i, (canvas, (low, high)) in enumerate(zip(canvases, limits, strict=True)):
        figure: Any = canvas.ax.figure
        cell = figure.get_size_inches() * canvas.ax.get_position(original=True).size
        middle, size = (low + high) / 2, (high - low) * [1, 1.15]
        size = cell * (size / cell).max()
        (left, bottom), (right, top) = middle - size * [0.5, 0.545], middle + size * [0.5, 0.455]
        canvas.ax.set(xlim=(left, right), ylim=(bottom, top))
        if i == 0 or not alike:
            add_bar(canvas, (left + 0.01 * size[0], bottom + 0.06 * size[1]), 0.5)
        if i == 0:
            add_axes(canvas, (right - 0.11 * size[1], bottom + 0.05 * size[1]), 0.07 * size[1])


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
    file: Path, scene: Scene, setup_name: str, radius: float, voxel: float
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
    figure, axes = _axes(
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
        _title(canvas.ax, name, text)
    _fit(canvases, alike=False)
    share = (
        f"{found['covered_voxels']:,} of {found['shell_voxels']:,} voxels covered: ζ ="
        f" {found['zeta_percent']:.1f} %"
    )
    _head(figure, f"{setup_name}, shell V_S of {radius:g} m", share)
    _key(figure, view, (UNSEEN_COLOUR, "uncovered (d)"))
    write_png(file, figure)
    return found


def shells(
    file: Path, scene: Scene, setup_name: str, radii: tuple[float, ...], voxel: float
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
    figure, axes = _axes(
        (width, 5.1), 1, len(radii), left=0.01, right=0.99, bottom=0.07, top=0.75, wspace=0.04
    )
    canvases = [canvas_of(ax, view) for ax, view in zip(axes, views, strict=True)]
    for letter, canvas, view, shown in zip("abcdefgh", canvases, views, found, strict=False):
        draw_both(canvas, view)
        share = (
            f"{shown['covered_voxels']:,} of {shown['shell_voxels']:,} voxels covered: ζ ="
            f" {shown['zeta_percent']:.1f} %"
        )
        _title(canvas.ax, f"({letter})  r_S = {shown['radius']:g} m", share)
    _fit(canvases, alike=True)
    _head(
        figure,
        f"{setup_name}, shells V_S of several radii",
        f"voxels of {100 * voxel:g} cm, cut open",
    )
    _key(figure, views[0], (paler(GREY, 0.55), "paler: covered, outside V_S"))
    write_png(file, figure)
    return found


def _anywhere(cones: Cones, voxel: float, rule: Rule) -> tuple[float, float]:
    """Return mean and standard deviation of the counted volume over random positions on the
    lattice, m^3.
    """
    moved = np.random.default_rng(0).uniform(0, voxel, (PLACES, 1, 3)) + cones.apex
    counts = [
        count(Cones(apex, cones.axis, cones.half_angle, cones.range_m), voxel, rule)
        for apex in moved
    ]
    return float(np.mean(counts)) * voxel**3, float(np.std(counts)) * voxel**3


def one_cone(file: Path) -> list[dict[str, float | str]]:
    """Draw the paper's cone, its discs, and its voxels of several sizes under centre and touch.

    Returns:
        For each rule and size: rule, voxel m, voxels, volume_m3, closed_form_m3, error_percent, and
            over random positions on the lattice mean_m3 and deviation_m3.
    """
    half, height = PAPER_SENSOR.fov / 2, PAPER_SENSOR.range_m
    solid = Cones(_APEX[None], _AXIS[None], np.array([half]), np.array([height]))
    figure, axes = _axes(
        (10, 9),
        2,
        1 + len(CONE_VOXELS),
        left=0.02,
        right=0.99,
        bottom=0.02,
        top=0.8,
        hspace=0.27,
        wspace=0.04,
    )
    canvases = [Canvas(ax, solid.bounds(), *EYE) for ax in axes]
    outline = _draw_cone(canvases[0], half, height)
    _draw_cone_discs(canvases[5], half, height)
    rows = [
        _draw_cone_voxels(canvas, solid, voxel, rule, outline)
        for canvas, (rule, voxel) in zip(
            [*canvases[1:5], *canvases[6:]],
            [(r, v) for r in _RULES for v in CONE_VOXELS],
            strict=True,
        )
    ]
    for canvas in canvases:
        canvas.draw()
    _fit(canvases, alike=True)
    places = f"{PLACES} places: mean ± standard deviation over random positions on the lattice, m³"
    rules = "; ".join(f"{rule}: a voxel counts when {when}" for rule, (_, when) in _RULES.items())
    _head(
        figure,
        "One sensor's cone in voxels",
        f"{rules}\n{places}; the paper: cone {PAPER_CONE:g}, octree {PAPER_OCTREE:g} m³",
    )
    write_png(file, figure)
    return rows


def _draw_cone(canvas: Canvas, half: float, height: float) -> np.ndarray:
    """Draw the paper's cone, and return its outline (M, 2) on the page."""
    rim = circle(_APEX + height * _AXIS, _AXIS, height * np.tan(half))
    outline: np.ndarray = canvas.hull(np.vstack([_APEX, rim]))
    canvas.mesh(cone(_APEX, _AXIS, half, height), _METAL, closed=True)
    _title(canvas.ax, "Cone", f"closed form\n{PAPER_SENSOR.volume:.4f} m³\n")
    return outline


def _draw_cone_discs(canvas: Canvas, half: float, height: float) -> None:
    """Draw the discs that make up the paper's cone."""
    for d in np.arange(_DISCS, height + 1e-9, _DISCS):
        disc = circle(_APEX + d * _AXIS, _AXIS, d * np.tan(half))
        canvas.faces(disc[None], paler(_METAL, 0.3), lit=False)
        canvas.lines(loops(disc[None]), GREY, 0.7)
    _title(canvas.ax, "Discs", f"{_DISCS:g} m apart\n\n")


def _draw_cone_voxels(
    canvas: Canvas, solid: Cones, voxel: float, rule: Rule, outline: np.ndarray
) -> dict[str, float | str]:
    """Draw the cone's voxels inside its ``outline``, and return the numbers; see ``one_cone``."""
    counted, truth = voxels(solid, voxel, rule), PAPER_SENSOR.volume
    s = skin(counted, canvas.rotation[2])
    line = 0.5 if voxel > CONE_VOXELS[-1] else 0.25
    colour = paler(_RULES[rule][0], 0.3)
    add_skin(canvas, s, colour, normals(solid, s.centres, voxel), 0.4, 1.12, line=line)
    canvas.ax.plot(*np.vstack([outline, outline[:1]]).T, color=INK, lw=0.9, zorder=4)
    error = 100 * (counted.volume / truth - 1)
    mean, deviation = _anywhere(solid, voxel, rule)
    text = (
        f"{len(counted):,} voxels\n{counted.volume:.4f} m³ ({error:+.1f} %)\n{PLACES} places:"
        f" {mean:.3f} ± {deviation:.3f}"
    )
    _title(canvas.ax, f"{rule}, {voxel:g} m", text.replace("-", "−"))
    return {
        "rule": rule,
        "voxel": voxel,
        "voxels": len(counted),
        "volume_m3": counted.volume,
        "closed_form_m3": truth,
        "error_percent": error,
        "mean_m3": mean,
        "deviation_m3": deviation,
    }
