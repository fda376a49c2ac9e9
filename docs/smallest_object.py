"""Draw the diameters of the largest unseen spheres and rods about the places near a UR10, in a
section through the largest of each.

Run: python docs/smallest_object.py [FILE]
"""

import sys
from pathlib import Path

import place_rings as pr
from place_rings.objectives.gap_map import GapMap
from place_rings.reporting.setup_report.smallest_object_section import object_picture

RADIUS, VOXEL = 0.1, 0.02  # m


def draw(file: Path) -> None:
    """Write the picture."""
    scene = pr.Scene(robot="ur10", targets=[pr.Near(RADIUS)])
    coverage = pr.verify("n2_16_25", scene, voxel=VOXEL, smallest_object=True)
    core, (objects,) = coverage.scene, coverage.objects
    target, pose = core.targets[0].target, objects.sphere.pose
    gaps = GapMap.of(core, coverage.setup, target, pose, VOXEL, objects.rod_length)
    object_picture(file, core, gaps, objects)


if __name__ == "__main__":
    own = Path(__file__).with_suffix(".png")
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else own)
