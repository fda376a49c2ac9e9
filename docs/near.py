"""Draw the paper's shell V_S beside the near volume V_N, in a section through the flange of a UR5e.

Run: python docs/near.py [FILE]
"""

import math
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import place_rings as pr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch, Wedge
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from scipy.spatial import ConvexHull

RADIUS, NEAREST, HALF_ANGLE = 0.3, 0.15, 45.0  # m, m, degrees
STEP = 0.004  # m, of the section
VOLUME, OWN, BODY, AHEAD = "#7fb3d9", "#e3e5e8", "#7d8791", "#d55e00"
TITLES = {
    "V_S": "V_S(0.3), the paper's shell: cut flat at base and flange",
    "V_N": "V_N(0.3), the near volume: closed around the flange",
}
TURN = np.linspace(0, 2 * np.pi, 49)


def ahead(flange: Any, axis: Any) -> Any:
    """Return random points (N, 3) m in the ball about the flange, ahead of it."""
    rng = np.random.default_rng(0)
    away = rng.normal(size=(1_000_000, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away = away[away @ axis >= math.cos(math.radians(HALF_ANGLE))]
    cubed = rng.uniform(NEAREST**3, RADIUS**3, (len(away), 1))
    return flange + np.cbrt(cubed) * away


def section(axes: Axes, target: pr.Near | pr.Shell) -> None:
    """Draw a target, the robot from the side, and the share of the space ahead of the flange."""
    scene = pr.Scene(robot="ur5e", targets=[target])
    frames = np.asarray(forward(scene.robot.chain, scene.poses[0].q))
    flange, solid = frames[-1, :3, 3], scene.solid(scene.targets[0].target, 0)
    axis = (flange - frames[-2, :3, 3]) / np.linalg.norm(flange - frames[-2, :3, 3])
    x, z = np.meshgrid(np.arange(-0.42, 1.2, STEP), np.arange(-0.42, 0.95, STEP))
    points = np.stack([x, np.full_like(x, flange[1]), z], axis=-1).reshape(-1, 3)
    inside, own = (np.asarray(part(points)).reshape(x.shape) for part in (solid, solid.b))
    axes.contourf(x, z, inside, [-9, 0], colors=[VOLUME])
    if target.kind == "V_S":
        axes.contourf(x, z, own, [-9, 0], colors=[OWN])
    bodies = robot_capsules(scene.robot, frames)
    hulls = []
    for a, b, r in zip(bodies.start, bodies.end, bodies.radius, strict=True):
        ends = [p[[0, 2]] + r * np.stack([np.cos(TURN), np.sin(TURN)], axis=1) for p in (a, b)]
        hulls.append(np.concatenate(ends)[ConvexHull(np.concatenate(ends)).vertices])
    axes.add_collection(PolyCollection(hulls, facecolors=BODY, edgecolors="white", linewidths=0.5))
    down = math.degrees(math.atan2(axis[2], axis[0]))
    axes.add_patch(
        Wedge(
            flange[[0, 2]],
            RADIUS,
            down - HALF_ANGLE,
            down + HALF_ANGLE,
            width=RADIUS - NEAREST,
            fill=False,
            edgecolor=AHEAD,
            linewidth=2,
        )
    )
    share = 100 * np.mean(np.asarray(solid(ahead(flange, axis))) <= 0)
    where = flange + (RADIUS + 0.05) * axis
    label = f"{share:.0f} % belong to {target.kind}"
    axes.text(where[0], where[2], label, color=AHEAD, ha="center", va="top", fontsize=12)
    axes.set_title(TITLES[target.kind], fontsize=12.5)
    axes.set(aspect="equal", xlabel="along the arm, m", ylabel="height, m")
    axes.set_ylim(-0.5, 0.95)


def main() -> None:
    """Draw and write the picture."""
    figure, axes = plt.subplots(1, 2, figsize=(12.6, 6.8), sharey=True)
    figure.subplots_adjust(left=0.06, right=0.99, top=0.95, bottom=0.18, wspace=0.03)
    section(axes[0], pr.Shell(RADIUS))
    section(axes[1], pr.Near(RADIUS))
    axes[1].set_ylabel("")
    ball = f"{NEAREST:g} to {RADIUS:g} m ahead of the flange, within {HALF_ANGLE:g}° of its axis"
    parts = (
        Patch(color=VOLUME, label="target, in the section through the flange"),
        Patch(color=OWN, label="V_R, excluded from V_S"),
        Patch(color=BODY, label="the robot's bodies from the side, excluded from V_N"),
        Patch(fill=False, edgecolor=AHEAD, linewidth=2, label=ball),
    )
    figure.legend(handles=parts, loc="lower center", ncols=2, fontsize=10, frameon=False)
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "near.png"
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
