"""What a check is to do: its parts, the stops of the mount check, the trials of the coverage check;
drawn up for a setup, and written for a person to read and print.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...formats.errors import UserError
from ...objectives.scene import Scene
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
    """What a check is to do, before anything is planned."""

    parts: tuple[Part, ...]
    """The parts to do."""
    seconds: float
    """Duration of the self check, s."""
    wave: bool
    """Whether a hand is passed over the sensors, ring by ring."""
    stops: int
    """Stops of the mount check."""
    trials: int
    """Trials of the coverage check, over all targets."""
    rod: Rod
    """The test rod."""
    move: bool
    """Whether a real robot may be moved."""
    reduced_near_stop: bool
    """Whether it may be moved where too few sensors keep the near stop."""
    voxel: float
    """Side of a voxel, m."""
    seed: int
    """Of everything drawn."""


@dataclass(frozen=True)
class Plans:
    """What is to be done. The rods' plans have the same poses, and their trials are numbered one
    after another.
    """

    seconds: float | None
    """Duration of the self check, s; None: no self check."""
    mount: MountPlan | None
    """Stops of the mount check; None: no mount check."""
    rods: tuple[RodPlan, ...] = ()
    """Trials of the coverage check in each target; none: no coverage check."""
    wave: bool = False
    """Whether a hand is passed over the sensors, ring by ring."""

    @property
    def poses(self) -> list[Float[np.ndarray, "P J"]]:
        """The poses at which the robot is to stand, (P, J) rad, for each part that has some, in
        order.
        """
        return [plan.joints for plan in (self.mount, *self.rods[:1]) if plan is not None]


def plan_check(setup: Setup, scene: Scene, options: CheckOptions, moved: bool) -> Plans:
    """Plan a check. The trials are shared evenly among the targets.

    Args:
        setup: the rings to check.
        scene: robot, cell and targets.
        options: what to plan.
        moved: whether the robot is moved by the check, and so needs clear poses.

    Raises:
        UserError: if no plan is possible.
    """
    clear = Clearance(scene, setup).of if moved else None
    targets = [goal.target for goal in scene.goals if "coverage" in options.parts]
    each = -(-options.trials // len(scene.goals))
    seconds = options.seconds if "self" in options.parts else None
    mount = None
    try:
        if "mount" in options.parts:
            mount = planned(scene, setup, options.stops, FRAMES, seed=options.seed, good=clear)
        rods = tuple(
            plan_rod(scene, setup, target, each, options.rod, seed=options.seed)
            for target in targets
        )
    except ValueError as error:
        raise UserError(f"check: {error}") from error
    return Plans(seconds, mount, rods, options.wave)


def write_plans(scene: Scene, plans: Plans, folder: Path) -> list[str]:
    """Write the plans into a folder; return the files' names."""
    files = []
    if plans.mount is not None:
        write_mount_plan(folder / "stops.toml", plans.mount)
        files.append("stops.toml")
    for plan in plans.rods:
        radius = "" if plan.target.radius is None else f"-{plan.target.radius:g}"
        files.append(f"trials-{plan.target.name}{radius}.toml")
        write_rod_plan(folder / files[-1], plan)
    if plans.rods:
        write_rod_pages(folder / "trials.pdf", scene, plans.rods)
        files.append("trials.pdf")
    return files
