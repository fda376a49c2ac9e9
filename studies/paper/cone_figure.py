"""Octree picture of one sensor's cone, in voxels of several sizes."""

from pathlib import Path

import numpy as np

from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.solids.cones import Cones
from ...coverage.voxels.octree import Rule, count, voxels
from ...reporting.plots import GREY, INK
from ...reporting.rendering.canvas import Canvas
from ...reporting.rendering.colours import paler
from ...reporting.rendering.figures import write_png
from ...reporting.rendering.meshes import circle, cone, loops
from ...reporting.rendering.voxels import add_skin, normals, skin
from .octree_panels import add_head, add_title, fit_panels, panel_axes
from .octree_view import EYE

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
    figure, axes = panel_axes(
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
    fit_panels(canvases, alike=True)
    places = f"{PLACES} places: mean ± standard deviation over random positions on the lattice, m³"
    rules = "; ".join(f"{rule}: a voxel counts when {when}" for rule, (_, when) in _RULES.items())
    add_head(
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
    add_title(canvas.ax, "Cone", f"closed form\n{PAPER_SENSOR.volume:.4f} m³\n")
    return outline


def _draw_cone_discs(canvas: Canvas, half: float, height: float) -> None:
    """Draw the discs that make up the paper's cone."""
    for d in np.arange(_DISCS, height + 1e-9, _DISCS):
        disc = circle(_APEX + d * _AXIS, _AXIS, d * np.tan(half))
        canvas.faces(disc[None], paler(_METAL, 0.3), lit=False)
        canvas.lines(loops(disc[None]), GREY, 0.7)
    add_title(canvas.ax, "Discs", f"{_DISCS:g} m apart\n\n")


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
    add_title(canvas.ax, f"{rule}, {voxel:g} m", text.replace("-", "−"))
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
