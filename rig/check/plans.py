"""Plans of a check: its parts, the stops of the mount check, and the trials of the coverage check,
also written to files for a person to read and print.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...formats.model_reader import read_model
from ...formats.writing import output_files, to_toml, write_text
from ...objectives.scene import Scene
from ..mount.stop_plan import FRAMES, MountPlan, MountPlanFile, planned, require_cell
from ..poses.itinerary import reachable
from ..poses.routes import Clearance
from ..rod.trial_plan import RodPlan, RodPlanFile, plan_rod
from ..rod.trial_sheets import write_rod_pages
from .options import CheckOptions, Part

STOPS = "stops.toml"


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


def plan_check(setup: Setup, scene: Scene, options: CheckOptions, moved: bool) -> Plans:
    """Plan a check. The trials are shared evenly among the targets.

    Args:
        setup: the rings to check.
        scene: robot, cell and targets.
        options: what to plan.
        moved: whether the check moves the robot, which requires poses with a clear way to them.

    Raises:
        UserError: if no plan is possible.
    """
    clear = Clearance(scene, setup).of if moved else None
    targets = [goal.target for goal in scene.targets if "coverage" in options.parts]
    each = -(-options.trials // len(scene.targets))
    looked = "self" in options.parts or options.move  # a real robot moves after it only
    seconds = options.seconds if looked else None
    mount = None
    if not setup.rings and options.parts == ("mount",):
        raise UserError(
            f"check: --part mount: {setup.sensors} single sensors and no ring; the mount check"
            " measures rings"
        )
    try:
        if "mount" in options.parts and setup.rings:
            require_cell(scene)
            among = reachable(scene, options.seed, clear, options.stops) if clear else None
            mount = planned(scene, setup, options.stops, FRAMES, seed=options.seed, among=among)
        rods = tuple(
            plan_rod(scene, setup, target, each, options.rod, seed=options.seed)
            for target in targets
        )
    except ValueError as error:
        raise UserError(f"check: {error}") from error
    return Plans(seconds, mount, rods, options.wave)


def trials_file(name: str, radius: float | None) -> str:
    """Return the name of the file of the trials in a target, by its name and radius."""
    name = re.sub(r"[^\w-]", "_", name) + ("" if radius is None else f"-{radius:g}")
    return f"trials-{name}.toml"


def read_plans(
    scene: Scene, parts: Sequence[Part], folder: Path, required: bool = True
) -> tuple[MountPlan | None, tuple[RodPlan, ...]]:
    """Return the plans in a folder that ``write_plans`` wrote: of the stops, and of the trials in
    each of the scene's targets.

    Args:
        scene: robot and targets.
        parts: whose plans to read.
        folder: the folder.
        required: whether a plan that is missing is an error; if not, it is left out. At least one
            must be there.

    Raises:
        UserError: if one is missing, or of another robot.
    """
    mount, rods = None, list[RodPlan]()
    if not required:
        files = {"mount": [STOPS], "coverage": [trials_file(*g.key) for g in scene.targets]}
        there = [
            part for part, names in files.items() if all((folder / n).is_file() for n in names)
        ]
        if not there:
            raise UserError(f"{folder}: found no plan, wanted: {STOPS}, as --plan-only writes it")
        parts = [part for part in parts if part in there]
    if "mount" in parts:
        mount = read_model(folder / STOPS, MountPlanFile)
        _require_joints(folder / STOPS, scene, mount.joints)
    for goal in scene.targets if "coverage" in parts else ():
        file = folder / trials_file(*goal.key)
        try:
            rods.append(read_model(file, RodPlanFile))
            scene.target_named(rods[-1].target, rods[-1].target_radius)
        except ValueError as error:
            raise UserError(f"{file}: {error}") from error
        _require_joints(file, scene, rods[-1].joints)
    return mount, tuple(rods)


def _require_joints(file: Path, scene: Scene, joints: Float[np.ndarray, "P J"]) -> None:
    wanted = len(scene.robot.chain)
    if joints.shape[1] != wanted:
        raise UserError(
            f"{file}: found poses of {joints.shape[1]} joints, wanted: {wanted}, as"
            f" {scene.robot.name} has"
        )


def write_plans(scene: Scene, plans: Plans, folder: Path) -> list[str]:
    """Write the plans into a folder; return the names of the files."""
    files = []
    with output_files(folder) as new:
        if plans.mount is not None:
            write_text(new / STOPS, to_toml(plans.mount, file=MountPlanFile))
            files.append(STOPS)
        for plan in plans.rods:
            files.append(trials_file(plan.target, plan.target_radius))
            write_text(new / files[-1], to_toml(plan, file=RodPlanFile))
        if plans.rods:
            write_rod_pages(new / "trials.pdf", scene, plans.rods)
            files.append("trials.pdf")
    return files
