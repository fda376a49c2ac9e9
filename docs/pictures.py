"""Draw the picture of the method: one function and its uses.

Run: python docs/pictures.py [FILE]
"""

import math
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.contour import ContourSet
from matplotlib.patches import Patch, Rectangle
from place_rings.coverage.solids.capsule_shadows import behind, capsule_shadow
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.segments import point_to_segment

LEFT, RIGHT, LOW, HIGH = 0.0, 1.6, -0.2, 1.0  # m, the plane y = 0
WIDTH = 0.03  # m, width of the sigmoid
SMALLEST = 0.0125  # m, side of the smallest cells
INSIDE, OUTSIDE, OPEN = "#3b7dd8", "#f3f3f0", "#e6862e"
BODIES = (((0.0, 0.0, 0.0), (0.8, 0.0, 0.0)), ((0.8, 0.0, 0.0), (1.0, 0.0, 0.5)))
RADIUS = 0.06  # m, radius of both bodies
NORM = TwoSlopeNorm(0.0, vmin=-0.2, vmax=0.4)  # colours of f, m


def sensors() -> Cones:
    """Return three sensors on the first body."""
    tilt = np.radians([-20.0, 15.0, 50.0])
    apex = np.array([[0.2, 0, 0.09], [0.4, 0, 0.09], [0.55, 0, 0.09]])
    axis = np.stack([np.sin(tilt), np.zeros(3), np.cos(tilt)], axis=1)
    return Cones(apex, axis, np.full(3, math.radians(12.5)), np.full(3, 0.9))


def seen(points: Any) -> Any:
    """Return the function of the covered space, with occlusion by the second body.

    It is the minimum over the sensors of max(cone, -behind).
    """
    cones, (start, end) = sensors(), (np.array(p) for p in BODIES[1])
    values = []
    for i in range(len(cones)):
        shadow = capsule_shadow(np.broadcast_to(cones.apex[i], points.shape), start, end, RADIUS)
        values.append(np.maximum(cones.part(points, i), -behind(points, shadow)))
    return np.minimum.reduce(values)


def contours(axes: Axes, function: Any) -> ContourSet:
    """Draw areas between lines of equal value every 5 cm, and the surface; return the areas."""
    x, z, points = grid()
    values = function(points).reshape(x.shape)
    areas = axes.contourf(
        x, z, values, np.arange(-0.2, 0.401, 0.05), cmap="RdBu", norm=NORM, extend="max"
    )
    axes.contour(x, z, values, [0.0], colors="black", linewidths=1.2)
    return areas


def soft(axes: Axes) -> Any:
    """Draw sigmoid(-f / width); return the image."""
    x, z, points = grid()
    return axes.pcolormesh(
        x,
        z,
        1 / (1 + np.exp(np.clip(seen(points) / WIDTH, -50, 50))).reshape(x.shape),
        cmap="Blues",
        vmin=0.0,
        vmax=1.0,
        rasterized=True,
    )


def cells(axes: Axes, corner: tuple[float, float], side: float) -> None:
    """Draw the octree's cells in the plane: classified by one value at the centre, or divided."""
    centre = np.array([[corner[0] + side / 2, 0.0, corner[1] + side / 2]])
    value, reach = float(seen(centre)[0]), math.sqrt(3) / 2 * side
    if abs(value) <= reach and side > SMALLEST:
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            cells(axes, (corner[0] + i * side / 2, corner[1] + j * side / 2), side / 2)
        return
    colour = INSIDE if value < -reach else OUTSIDE if value > reach else OPEN
    axes.add_patch(
        Rectangle(corner, side, side, facecolor=colour, edgecolor="white", linewidth=0.3)
    )


def grid() -> tuple[Any, Any, Any]:
    """Return the points of the plane."""
    x, z = np.meshgrid(np.linspace(LEFT, RIGHT, 321), np.linspace(LOW, HIGH, 241))
    return x, z, np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)


def bodies(axes: Axes) -> None:
    """Draw the robot."""
    x, z, points = grid()
    distance = np.minimum.reduce(
        [point_to_segment(points, np.array(start), np.array(end)) for start, end in BODIES]
    )
    axes.contourf(x, z, (distance - RADIUS).reshape(x.shape), [-1.0, 0.0], colors=["#666666"])


def main() -> None:
    """Draw and write the picture."""
    figure, axes = plt.subplots(
        2, 2, figsize=(12.6, 8.6), layout="constrained", sharex=True, sharey=True
    )
    contours(axes[0, 0], sensors())
    areas = contours(axes[0, 1], seen)
    degree = soft(axes[1, 0])
    for i in range(2):
        cells(axes[1, 1], (LEFT + 0.8 * i, LOW), 0.8)
        cells(axes[1, 1], (LEFT + 0.8 * i, LOW + 0.8), 0.8)
    titles = (
        "Three cones: f = min of three functions",
        "With a shadow: max(cone, −behind)",
        "Soft occupancy, for gradients",
        "Octree cells, for the exact count",
    )
    for one, title in zip(axes.flat, titles, strict=True):
        bodies(one)
        one.set(title=title, xlim=(LEFT, RIGHT), ylim=(LOW, HIGH), aspect="equal")
    for one in axes[1]:
        one.set_xlabel("x (m)")
    for one in axes[:, 0]:
        one.set_ylabel("z (m)")
    figure.colorbar(
        areas,
        ax=axes,
        shrink=0.46,
        anchor=(0.0, 0.97),
        pad=0.01,
        label="f (m), negative where covered",
    )
    inset = axes[1, 0].inset_axes((0.58, 0.16, 0.38, 0.045))
    figure.colorbar(degree, cax=inset, orientation="horizontal", label="degree of coverage")
    kinds = {"inside": INSIDE, "outside": OUTSIDE, "undecided": OPEN}
    axes[1, 1].legend(
        handles=[Patch(facecolor=c, edgecolor="grey", label=name) for name, c in kinds.items()],
        title="cells",
        loc="lower right",
    )
    file = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "method.png"
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main()
