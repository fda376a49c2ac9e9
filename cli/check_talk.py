"""What a check says in a terminal: what will move, and what was found."""

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from ..formats.errors import UserError
from ..objectives.scene import Scene
from ..rig.check_models import DISCLAIMER
from ..rig.judge import Judged
from ..rig.operators import Itinerary
from ..rig.procedure import Plans


def confirm(scene: Scene, plans: Plans, itinerary: Itinerary, console: Console) -> None:
    """Say what will move, and ask."""
    reached = len(itinerary.order(plans.poses))
    speed, acceleration = math.degrees(scene.motion.speed), math.degrees(scene.motion.acceleration)
    alarm = np.concatenate(itinerary.limits)
    lines = [
        f"The robot will move to {reached} of {len(plans.poses)} poses, its leading joint at up to {speed:g}°/s and"
        f" {acceleration:g}°/s². It stops on a fault of a link, on Ctrl-C, and on a reading nearer than"
        f" {1000 * scene.motion.near:.0f} mm; {np.count_nonzero(alarm < scene.motion.near)} of {len(alarm)} sensors may see"
        f" the robot itself nearer than that, and stop it later, {np.count_nonzero(alarm == 0)} of them never.",
        DISCLAIMER,
        "Keep out of its reach, and a hand on its emergency stop.",
    ]
    for line in lines:
        console.print(line, highlight=False, soft_wrap=True)
    try:
        answer = console.input("Type yes to let it move > ").strip()
    except EOFError:
        answer = ""
    if answer != "yes":
        raise UserError("--move: not confirmed, nothing was moved; allowed: yes")


EXIT = {"as proposed": 0, "differs": 1, "unfinished": 3}  # 2: bad input


def tell(judged: Judged, files: Sequence[str], folder: Path, as_json: bool) -> int:
    """Print the verdict and where the files are, or the result as JSON; the exit code of the verdict."""
    r = judged.result
    if as_json:
        print(r.model_dump_json(indent=2))
        return EXIT[r.verdict]
    console = Console(file=sys.stdout)
    lines = [f"{r.setup}: {r.verdict}", *(f"  {reason}" for reason in r.reasons)]
    lines += [f"  warning: {warning}" for warning in r.warnings]
    if r.mount is not None:
        for one in r.mount.rings:
            errors = ", ".join(f"{e.name} {e.value:+.2f} ± {e.margin:.2f} {e.unit}" for e in one.errors)
            lines.append(f"ring {one.ring} ({one.link}): {errors}")
        lines += [
            f"{z.named}: {z.proposed_percent:.2f} % as proposed, {z.alive_percent:.2f} % as built and answering"
            for z in r.mount.zeta
        ]
    for c in r.coverage:
        found = f"{c.measured_percent:.1f} % ({c.low_percent:.1f} to {c.high_percent:.1f})"
        lines.append(f"rod: seen in {found} of {c.named} by {c.trials} trials, predicted {c.predicted_percent:.1f} %")
    for line in [*lines, r.disclaimer, *(f"  {folder / name}" for name in files)]:
        console.print(line, highlight=False, soft_wrap=True, markup=False)
    return EXIT[r.verdict]
