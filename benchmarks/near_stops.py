"""Near stops: sensors that keep the whole near stop along the route of a check.

The route is that of `place-rings check LAYOUT --rig sim --part mount`: 24 planned stops in the
simulated rig's cell of floor, table and wall, and the paths between them. A sensor that may see the
robot's own body does not keep the whole near stop there. The share is a mean over the poses of the
route, as `near_share` under `[motion]` limits it. `rings_as_proposed = true` states that every ring
is wired and mounted the right way round. The proposal is that of
`place-rings --target V_S --radius 0.5` on the reference scene.

Run: python benchmarks near_stops
"""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from common import table
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.formats.loader import resolve
from place_rings.objectives.scene import CoreScene
from place_rings.rig.mount.stop_plan import FRAMES, POSES, planned
from place_rings.rig.poses.itinerary import Itinerary
from place_rings.rig.poses.near_stops import NearStops
from place_rings.rig.poses.routes import Clearance
from place_rings.rig.simulated_cell.cell import with_cell

_SEARCH = ("-m", "place_rings.cli.entry", "--target", "V_S", "--radius", "0.5")


def along_the_route(setup: Setup, scene: CoreScene, as_proposed: bool) -> NearStops:
    """Return the near stops along the route of a mount check of a simulated rig."""
    scene = with_cell(scene)
    scene = replace(scene, motion=replace(scene.motion, rings_as_proposed=as_proposed))
    setup = rounded(setup, scene.sensor)
    clear = Clearance(scene, setup).of
    stops = planned(scene, setup, POSES, FRAMES, seed=0, good=clear).joints
    return Itinerary(scene, setup, scene.poses[0].q, [stops], 0).near_stops()


def report() -> list[str]:
    """Return the table for the paper's layout and a proposal of the search."""
    rows = []
    with TemporaryDirectory() as folder:
        subprocess.run([sys.executable, *_SEARCH, "--out", folder], check=True, capture_output=True)
        proposal = str(Path(folder) / "proposal.toml")
        for name, subject in (("n2_16_25", "n2_16_25"), ("proposal", proposal)):
            setup, scene = resolve(subject, None)
            shares = [along_the_route(setup, scene, known).share for known in (False, True)]
            rows.append((name, setup.sensors, *(f"{100 * share:.0f}" for share in shares)))
            print(*rows[-1], flush=True)
    columns = ("layout", "sensors", "orientation unknown, %", "rings as proposed, %")
    lines = (__doc__ or "").partition("\n\nRun:")[0].splitlines()[2:]
    return [*lines, "", *table(columns, rows)]


if __name__ == "__main__":
    print(*report(), sep="\n")
