"""How robust a setup is, counted and in rows of a table: blind sensors and rings, errors of its
mounting.
"""

from dataclasses import dataclass
from functools import partial

from rich.table import Table

from ..coverage.rings.mounting_errors import MountingErrors
from ..coverage.rings.ring import Setup
from ..formats.schema.robustness_models import LossModel, RobustnessResult
from ..objectives.redundancy import redundancy
from ..objectives.scene import Scene
from ..objectives.tolerance import tolerance
from ..objectives.verify import Verifier
from .progress import Progress
from .tables import target_label
from .terminal import Terminal


@dataclass(frozen=True)
class Robustness:
    """What a report is asked: sensors told apart, voxel m, errors of mounting, how many draws,
    their seed.
    """

    most: int
    voxel: float
    errors: MountingErrors
    draws: int
    seed: int


def assess(
    name: str, setup: Setup, scene: Scene, asked: Robustness, console: Terminal
) -> list[RobustnessResult]:
    """Redundancy and tolerance of ``setup`` for the scene's goals, with a progress bar on
    ``console``.
    """
    verifier, results = Verifier(scene, asked.voxel), []
    with Progress(console) as bar:
        for goal in scene.goals:
            task = bar.add_task(str(goal.target), total=asked.draws * len(scene.poses))
            sure = redundancy(verifier, setup, goal.target, asked.most)
            drawing = (setup, goal.target, asked.errors, asked.draws, asked.seed)
            astray = tolerance(verifier, *drawing, partial(bar.advance, task))
            results.append(RobustnessResult.of(name, setup, sure, astray))
    return results


def robustness_rows(results: list[RobustnessResult]) -> list[list[str]]:
    """Questions down, targets across, in percent: the question, then a cell for each."""
    e = results[0].errors
    luck = (
        f"{e.draws} mountings, ±{e.position_mm:g} mm,"
        f" ±{e.direction_deg:g}°{' (2 σ)' if e.law == 'normal' else ''}"
    )
    seen = {f"seen by at least {k} sensors": k for k in range(2, len(results[0].seen_percent) + 1)}
    rows = {
        "ζ": [r.zeta_percent for r in results],
        **{what: [r.seen_percent[k - 1] for r in results] for what, k in seen.items()},
        "ζ without the worst sensor": [r.worst_sensor.zeta_percent for r in results],
        "ζ without the worst ring": [r.worst_ring.zeta_percent for r in results],
        f"mean ζ of {luck}": [r.mean_percent for r in results],
        "5th percentile of these": [r.fifth_percentile_percent for r in results],
    }
    return [[what, *(f"{v:.2f}" for v in values)] for what, values in rows.items()]


def robustness_table(results: list[RobustnessResult]) -> Table:
    """The same for the terminal."""
    first = results[0]
    title = f"{first.setup} in percent, rule centre, voxels of {first.voxel:g} m"
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for r in results:
        table.add_column(target_label(r), justify="right")
    for row in robustness_rows(results):
        table.add_row(*row)
    return table


def lines(r: RobustnessResult) -> str:
    """Which sensor and ring are missed most, and how far the draws are to be trusted."""

    def lost(loss: LossModel) -> str:
        ring = f"ring {loss.ring} on {loss.link}"
        return ring if loss.sensor is None else f"sensor {loss.sensor} of {ring}"

    error = (
        "" if r.mean_error_percent is None else f" ± {r.mean_error_percent:.2f} (standard error)"
    )
    return (
        f"missed most: {lost(r.worst_sensor)} and {lost(r.worst_ring)}; mean under errors"
        f" {r.mean_percent:.2f}{error}, least {r.worst_percent:.2f}; {r.seconds:.1f} s"
    )
