"""Plans of a check: its parts, the stops of the mount check, and the trials of the coverage check,
also written to files for a person to read and print.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...formats.errors import UserError
from ...objectives.scene import CoreScene
from ..mount.stop_plan import FRAMES, MountPlan, planned
from ..poses.routes import Clearance
from ..rod.rod import Rod
from ..rod.trial_plan import RodPlan, plan_rod
from ..rod.trial_sheets import write_rod_pages
from .plan_files import write_mount_plan, write_rod_plan

Part = Literal["self", "mount", "coverage"]
PARTS: tuple[Part, ...] = ("self", "mount", "coverage")


@dataclass(frozen=True)
class CheckOptions:
    """Options of a check, before planning."""

    parts: tuple[Part, ...]
    """Parts to run."""
    seconds: float
    """Duration of the self check, s."""
    wave: bool
    """Whether a hand passes over the sensors, ring by ring."""
    stops: int
    """Number of stops of the mount check."""
    trials: int
    """Number of trials of the coverage check, over all targets."""
    rod: Rod
    """The test rod."""
    move: bool
    """Whether the check may move a real robot."""
    reduced_near_stop: bool
    """Whether it may move the robot although too few sensors keep the full near stop."""
    voxel: float
    """Side of a voxel, m."""
    seed: int
    """Seed of all random draws."""


@dataclass(frozen=True)
class Plans:
    """The planned parts. All plans of the rod have the same poses, and their trials are numbered
    consecutively.
    """

    seconds: float | None
    """Duration of the self check, s; None: no self check."""
    mount: MountPlan | None
    """Stops of the mount check; None: no mount check."""
    rods: tuple[RodPlan, ...] = ()
    """Trials of the coverage check in each target; none: no coverage check."""
    wave: bool = False
    """Whether a hand passes over the sensors, ring by ring."""

    @property
    def poses(self) -> list[Float[np.ndarray, "P J"]]:
        """Poses (P, J) rad at which the robot stands, for each part that has some, in order."""
        return [plan.joints for plan in (self.mount, *self.rods[:1]) if plan is not None]


def plan_check(setup: Setup, scene: CoreScene, options: CheckOptions, moved: bool) -> Plans:
    """Plan a check. The trials are shared evenly among the targets.

    Args:
        setup: the rings to check.
        scene: robot, cell and targets.
        options: what to plan.
        moved: whether the check moves the robot, which requires collision-free poses.

    Raises:
        UserError: if no plan is possible.
    """
    clear = Clearance(scene, setup).of if moved else None
    targets = [goal.target for goal in scene.goals if "coverage" in options.parts]
    each = -(-options.trials // len(scene.goals))
    seconds = options.seconds if "self" in options.parts else None
    mount = None
    if not setup.rings and options.parts == ("mount",):
        raise UserError(
            f"check: --part mount: {setup.sensors} single sensors and no ring; the mount check"
            " measures rings"
        )
    try:
        if "mount" in options.parts and setup.rings:
            mount = planned(scene, setup, options.stops, FRAMES, seed=options.seed, good=clear)
        rods = tuple(
            plan_rod(scene, setup, target, each, options.rod, seed=options.seed)
            for target in targets
        )
    except ValueError as error:
        raise UserError(f"check: {error}") from error
    return Plans(seconds, mount, rods, options.wave)


def write_plans(scene: CoreScene, plans: Plans, folder: Path) -> list[str]:
    """Write the plans into a folder; return the names of the files."""
    files = []
    if plans.mount is not None:
        write_mount_plan(folder / "stops.toml", plans.mount)
        files.append("stops.toml")
    for plan in plans.rods:
        name, radius = plan.target.key
        name = re.sub(r"[^\w-]", "_", name) + ("" if radius is None else f"-{radius:g}")
        files.append(f"trials-{name}.toml")
        write_rod_plan(folder / files[-1], plan)
    if plans.rods:
        write_rod_pages(folder / "trials.pdf", scene, plans.rods)
        files.append("trials.pdf")
    return files
