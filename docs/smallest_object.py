"""Draw the distance of uncovered places near a UR10 from covered ones, in a vertical section
through the largest unseen sphere.

Run: python docs/smallest_object.py [FILE]
"""

import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import place_rings as pr
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Patch
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.voxels.largest_object import BALL
from place_rings.coverage.voxels.unseen_cells import AT_CENTRE
from place_rings.objectives.smallest_object import unseen_space

RADIUS, VOXEL, FINER = 0.1, 0.02, 2  # m, m, times by which a voxel is halved for the picture
STEP, EDGE = 0.001, 0.03  # m, of the section and around it
COVERED, BODY, SPHERE, INK = "#f2a93b", "#7d8791", "#d1245b", "#30363c"


def section(ax: Axes) -> None:
    """Draw distances, covered places, the robot's body and the sphere."""
    scene = pr.Scene(robot="ur10", targets=[pr.Near(RADIUS)])
    coverage = pr.verify("n2_16_25", scene, voxel=VOXEL, smallest_object=True)
    core, sphere = coverage.scene, coverage.objects[0].sphere
    centre = np.array(sphere.centre)
    here = unseen_space(core, coverage.setup, core.targets[0].target, 0, VOXEL)
    grid = here.space.grid(here.grid.open.cells.level - FINER)
    mm = 1000 * BALL.field(grid.state >= AT_CENTRE, grid.side, math.inf)
    low = grid.centres(np.zeros((1, 3), int))[0] - grid.side / 2
    high = low + grid.side * np.array(mm.shape)
    row = math.floor((centre[1] - low[1]) / grid.side)
    first, last = here.space.target.bounds()
    x, z = (np.arange(first[i] - EDGE, last[i] + EDGE, STEP) for i in (0, 2))
    points = np.stack([*np.broadcast_arrays(x, centre[1], z[:, None])], -1).reshape(-1, 3)
    bodies = robot_capsules(core.robot, forward(core.robot.chain, core.poses[0].q))
    body, target, seen = (
        np.asarray(solid(points)).reshape(len(z), len(x))
        for solid in (bodies, here.space.target, here.space.seen)
    )
    extent = (low[0], high[0], low[2], high[2])
    image = ax.imshow(
        mm[:, row].T, cmap="Blues", origin="lower", extent=extent, vmin=0, interpolation="bilinear"
    )
    ax.contourf(x, z, target, [0, 9], colors=["white"])
    ax.contourf(x, z, np.maximum(seen, target), [-9, 0], colors=[COVERED])
    ax.contour(x, z, target, [0], colors=[INK], linewidths=0.8)
    ax.contourf(x, z, body, [-9, 0], colors=[BODY])
    middle = centre[[0, 2]]
    ax.add_patch(Circle(middle, sphere.low / 2, fill=False, ec=SPHERE, lw=2))
    label = middle - (0.05, 0.25)
    ax.plot(*zip(middle, label, strict=True), color=SPHERE, lw=1)
    words = f"⌀ {1000 * sphere.low:.0f} mm"
    ax.text(*(label - (0, 0.01)), words, color=SPHERE, fontsize=12, ha="center", va="top")
    ax.figure.colorbar(image, label="distance to covered places or the edge, mm", fraction=0.03)
    ax.set(aspect="equal", xlim=x[[0, -1]], ylim=z[[0, -1]])
    ax.set(xlabel="along the arm, m", ylabel="height, m")


def draw(file: Path) -> None:
    """Write the picture."""
    figure, ax = plt.subplots(figsize=(9.0, 5.0), layout="constrained")
    section(ax)
    patches = [Patch(color=COVERED, label="covered"), Patch(color=BODY, label="robot's body")]
    ax.legend(handles=patches, frameon=False, fontsize=9, loc="upper left")
    ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    own = Path(__file__).with_suffix(".png")
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else own)
