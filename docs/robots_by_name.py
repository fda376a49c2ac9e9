"""Print a table of robots by the names of robot_descriptions: chain, mounts and bodies of each.

Run: python docs/robots_by_name.py NAME...

It reads the copies that robot_descriptions keeps on this machine. A mesh that is missing there is
left out, and the table says so.
"""

import sys
import time

from place_rings.coverage.definitions.errors import UserError
from place_rings.formats.robots.descriptions import XACRO
from place_rings.formats.robots.urdf_options import UrdfOptions

HEAD = ("name", "file", "joints", "tip", "reach, m", "mounts, mm", "capsules", "s")


def row(name: str) -> list[str]:
    """Return the cells of a robot."""
    path, options = UrdfOptions(skip_missing_meshes=True).located(name)
    begun = time.process_time()
    fit = options.fit(path)
    robot, seconds = fit.robot, time.process_time() - begun
    mounts = [f"{mount.link} {1000 * mount.length:.0f}" for mount in robot.mounts if mount.length]
    missing = sum("does not exist" in note for note in fit.notes)
    kind = "xacro" if path.suffix == XACRO else path.suffix[1:].upper()
    return [
        f"`{name}`",
        kind,
        f"{len(robot.chain)}",
        options.pick(options.read(path)).tip,
        f"{robot.reach:.2f}",
        ", ".join(mounts) or "none",
        f"{len(robot.bodies)}" + f" ({missing} meshes missing)" * bool(missing),
        f"{seconds:.0f}",
    ]


def main() -> None:
    """Print a line for each name; a robot that cannot be read states why."""
    print(f"| {' | '.join(HEAD)} |\n|{' --- |' * len(HEAD)}")
    for name in sys.argv[1:]:
        try:
            cells = row(name)
        except UserError as error:
            cells = [f"`{name}`", str(error), *[""] * (len(HEAD) - 2)]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
