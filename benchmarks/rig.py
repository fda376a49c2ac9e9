"""Rig: margins of checks, and times to detection and standstill under faults.

Everything runs on the simulated rig, through unmodified ur-rtde and pyserial.
"""

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import rig_checks
import rig_moving
from common import absent, busy, installed, say, table
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.objectives.named_layouts import layout_in, ring_layout
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.search import search
from place_rings.placement.space.design import Space
from place_rings.rig.mount.stop_plan import POSES, planned
from place_rings.rig.poses.itinerary import Itinerary, reachable
from place_rings.rig.poses.routes import Clearance
from place_rings.rig.simulated_cell.cell import with_cell
from rig_faults import faults


@dataclass(frozen=True)
class Runs:
    """How often the benchmark repeats what it measures."""

    faults: int
    """Runs of each fault of a link."""
    moving: int
    """Runs of each fault of a moving robot."""
    checks: int
    """Checks with injected errors."""
    late: int
    """Checks whose frames come late."""
    loads: tuple[int, ...]
    """Numbers of busy processes beside the faults."""


SHORT, FULL = Runs(1, 1, 10, 10, (0,)), Runs(10, 10, 200, 200, (0, 8))


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown."""
    runs = FULL if full else SHORT
    blocks = [*rig_checks.report(runs.checks, runs.late), *near_stops()]
    if not installed("ur-rtde"):
        return [*blocks, absent("ur-rtde", 1)[0]]
    for processes in runs.loads:
        beside = f"beside {processes} busy processes" if processes else "alone"
        with busy(processes):
            blocks += [
                f"Faults of the links, {beside} on {os.cpu_count()} cores:",
                *faults(runs.faults),
                f"Faults while the robot moves, {beside}:",
                *rig_moving.report(runs.moving),
            ]
    return blocks


def near_stops() -> list[str]:
    """Measure the near stops of the paper's layout and of a proposal; return blocks of Markdown."""
    scene, rows = Scene(), []
    space, context = Space(scene, ring_layout(scene, 2, 16)), SearchContext(Verifier(scene))
    proposal = search(space, SearchOptions(), context).setup
    setups = {"n2_16_25": layout_in(scene, "n2_16_25"), "proposal": proposal}
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for name, setup in setups.items():
            shares = pool.map(near_share, [setup] * 2, [scene] * 2, (False, True))
            rows.append((name, setup.sensors, *(f"{100 * share:.0f}" for share in shares)))
            say(*rows[-1])
    return [
        "Sensors that keep the whole near stop along the route of `place-rings check --rig sim"
        " --part mount`, as a mean over its poses (`near_share` under `[motion]` limits it); a"
        " sensor that may see the robot's own body does not keep it. The proposal is that of"
        " `place-rings --target V_S --radius 0.5`.",
        table(("layout", "sensors", "orientation unknown, %", "`rings_as_proposed`, %"), rows),
    ]


def near_share(setup: Setup, scene: Scene, as_proposed: bool) -> float:
    """Return the share of sensors that keep the near stop along the route of a mount check."""
    motion = replace(scene.motion, rings_as_proposed=as_proposed)
    scene, setup = replace(with_cell(scene), motion=motion), rounded(setup, scene.sensor)
    among = reachable(scene, 0, Clearance(scene, setup).of, POSES)
    stops = planned(scene, setup, among=among).joints
    return Itinerary(scene, setup, scene.poses[0].q, [stops], 0).near_stops().share
