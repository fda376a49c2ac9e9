"""The commands that look at a setup: its exact zeta, its cones."""

import csv
import sys

import numpy as np
from rich.console import Console

from ..coverage.rings import Setup, sensor_cones
from ..objectives.exact import Rule, Verifier
from ..objectives.scene import Scene
from ..placement.convert import verify_result
from .place import check_scene
from .tables import zeta_table

CONE_COLUMNS = "pose,ring,sensor,apex_x,apex_y,apex_z,axis_x,axis_y,axis_z,fov_deg,range_m".split(",")  # noqa: SIM905


def verify(name: str, setup: Setup, scene: Scene, voxel: float, rule: Rule, as_json: bool) -> None:
    """Print the exact zeta of ``setup`` for the scene's goals."""
    check_scene(scene, voxel)
    verifier = Verifier(scene, voxel, rule)
    with Console(stderr=True).status("counting"):
        results = [verify_result(name, verifier.verify(setup, goal.target)) for goal in scene.goals]
    if as_json:
        records = [r.model_dump_json(indent=2) for r in results]
        print(records[0] if len(records) == 1 else "[" + ",\n".join(records) + "]")
        return
    title = f"ζ in percent, rule {rule}, voxels of {voxel:g} m, robot {scene.robot.name}"
    console = Console()
    console.print(zeta_table(results, {name: setup.sensors}, title))
    if len(scene.poses) > 1:
        for r in results:
            each = ", ".join(f"{p.zeta_percent:.2f}" for p in r.poses)
            console.print(f"{r.target}: pose by pose {each}")


def cones(setup: Setup, scene: Scene) -> None:
    """Print the sensors' cones at every pose as CSV, base frame."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(CONE_COLUMNS)
    labels = [(i, k) for i, ring in enumerate(setup.rings) for k in range(ring.count)]
    for p, pose in enumerate(scene.poses):
        c = sensor_cones(scene.robot, setup, pose.q)
        for (i, k), apex, axis, half, range_m in zip(labels, c.apex, c.axis, c.half_angle, c.range_m, strict=True):
            numbers = [round(float(v), 9) + 0.0 for v in (*apex, *axis, 2 * np.degrees(half), range_m)]
            writer.writerow([p, i, k, *numbers])
