"""Tables for the terminal."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from rich.table import Table

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.robots.robot import Robot
from ..formats.schema.result_models import PoseZetaModel, ProofModel, VerifyResult, WorstModel
from ..formats.schema.robustness_models import RobustnessResult
from ..objectives.robustness import RingSensitivity
from .explained import Explained
from .text import counted, coverage_caption, with_error

_WIDE = 3  # at most this many targets: the worst pose gets columns of its own


def ring_table(
    setup: Setup, robot: Robot, sensitivity: Sequence[RingSensitivity] = ()
) -> Explained:
    """Return a table of rings: link, position, sensors, tilt, phase, and what errors of these cost
    where that is known."""
    table = Table()
    costs = ("points/mm", "points/°") if sensitivity else ()
    known = {(one.link, one.position): _costs(one) for one in sensitivity}
    each = [known.get((r.link, r.position)) for r in setup.rings]
    for name in ("ring", "link", "position", "mm", "sensors", "tilt °", "phase °", *costs):
        table.add_column(name, justify="left" if name == "link" else "right")
    for i, r in enumerate(setup.rings):
        length = robot.mount(r.link).length
        place = (
            (f"{r.position:.3f}", f"{1000 * r.position * length:.0f}")
            if length > 0
            else ("flange", "–")
        )
        cost = [f"{a:.3f}" for a in each[i] or ()] or ["–" for _ in costs]
        table.add_row(
            str(i),
            r.link,
            *place,
            str(r.count),
            f"{math.degrees(r.tilt):+.1f}",
            f"{math.degrees(r.phase):.1f}",
            *cost,
        )
    for i, one in enumerate(setup.singles, start=len(setup.rings)):
        table.add_row(str(i), one.link, "single", "–", "1", "–", "–", *["–" for _ in costs])
    title = f"{counted(len(setup.rings), 'ring')}, {counted(setup.sensors, 'sensor')}"
    below = (
        "position: 0 at the link's proximal end, 1 at its distal end; mm: distance from the"
        " proximal end; tilt: positive towards the distal end; phase: angle of the first sensor"
        " about the link's axis."
    )
    if sensitivity:
        dearest = max(range(len(each)), key=lambda i: sum(each[i] or ()))
        below += (
            " points/mm and points/°: coverage lost if the ring is off along the link, or in tilt"
            f" or phase. Mount ring {dearest} most carefully."
        )
    return Explained(title, table, below)


def _costs(one: RingSensitivity) -> tuple[float, float]:
    return 100 * one.per_mm, 100 * one.per_degree


def target_label(result: VerifyResult | RobustnessResult) -> str:
    """Return a target's label: ``V_S(0.5)`` or ``V_OT``."""
    return result.target if result.radius is None else f"{result.target}({result.radius:g})"


def result_caption(result: VerifyResult) -> str:
    """Return the coverage of a record's target as a caption."""
    dark = result.dark_clothing_percent
    return coverage_caption(target_label(result), result.zeta_percent, dark)


def percent(result: VerifyResult | PoseZetaModel | WorstModel, rule: str) -> str:
    """Return ζ in percent with its error, or its certified interval, rounded outward."""
    if rule == "certified":
        decimals = min(
            max(2, 1 - math.floor(math.log10(max(result.high_percent - result.low_percent, 1e-9)))),
            8,
        )
        low, high = (
            math.floor(result.low_percent * 10**decimals) / 10**decimals,
            math.ceil(result.high_percent * 10**decimals) / 10**decimals,
        )
        return f"{low:.{decimals}f} … {high:.{decimals}f}"
    error = result.error_points
    return with_error(result.zeta_percent, None if error is None else error / 100)


def percent_under(result: VerifyResult, model: Occlusion) -> str:
    """Return ζ in percent under a model of occlusion, with its error."""
    error = result.by_occlusion_error_points.get(model)
    return with_error(result.by_occlusion_percent[model], None if error is None else error / 100)


def proof_line(result: VerifyResult, proof: ProofModel) -> str:
    """Return a line on the width and the cost of a certified interval."""
    width = result.high_percent - result.low_percent
    if proof.reached or proof.width_percent == 0:
        verdict = f"guaranteed: width {width:.2g} points"
    else:
        verdict = f"guaranteed, but {width:.2g} points wide instead of {proof.width_percent:g}"
    return (
        f"{target_label(result)} {verdict}; {proof.passes} passes, {proof.cells:,} cells down to"
        f" {1000 * proof.smallest:.3g} mm, {result.seconds:.1f} s"
    )


_TARGETS = {
    "V_S": "V_S(r): discs of r m across the arm's centre line, cut flat at the tool",
    "V_N": "V_N(r): everything within r m of the robot's bodies",
    "V_O": "V_O: sphere of the robot's reach",
    "V_T": "V_T: sphere around the tool, of 1.5 m unless the scene says otherwise",
    "V_OT": "V_OT: V_O and V_T together",
    "V_P": "V_P: protective volume of ISO/TS 15066",
}


def target_legend(results: Sequence[VerifyResult | RobustnessResult]) -> str:
    """Return a sentence that explains the targets of the results."""
    names = {r.target for r in results}
    lines = [text for name, text in _TARGETS.items() if name in names]
    return "; ".join(lines) + "." if lines else ""


DARK = "dark clothing: with the sensors' range on cloth of 17 % at their light"


def dark_columns(results: Sequence[VerifyResult]) -> dict[str, dict[str, str]]:
    """Return ζ for dark clothing in percent by the target's label and the setup, of those targets
    for which it is known."""
    known: dict[str, dict[str, str]] = {}
    for r in results:
        if r.dark_clothing_percent is not None:
            known.setdefault(target_label(r), {})[r.setup] = f"{r.dark_clothing_percent:.2f}"
    return known


def zeta_table(
    results: list[VerifyResult],
    sensors: dict[str, int],
    where: str,
    prices: Mapping[str, str] = MappingProxyType({}),
) -> Explained:
    """Return ζ in percent with a row for each setup and a column for each target.

    Over several poses ζ is their mean; for few targets the table also shows the worst pose.

    Args:
        results: the counts.
        sensors: number of sensors of each setup.
        where: scene and way to count, for the title.
        prices: price of each setup, as text; none without prices.
    """
    labels = list(dict.fromkeys(target_label(r) for r in results))
    table = Table()
    table.add_column("setup")
    table.add_column("sensors", justify="right")
    if prices:
        table.add_column("price", justify="right")
    for label in labels:
        table.add_column(label, justify="right")
    worst = [label for label in labels if any(r.worst for r in results if target_label(r) == label)]
    worst = worst if len(labels) <= _WIDE else []
    for label in worst:
        table.add_column(f"{label} worst", justify="right")
    dark = dark_columns(results)
    for label in dark:
        table.add_column(f"{label} dark clothing", justify="right")
    for name in dict.fromkeys(r.setup for r in results):
        cells = {target_label(r): percent(r, r.rule) for r in results if r.setup == name}
        least = {
            target_label(r): percent(r.worst, r.rule)
            for r in results
            if r.setup == name and r.worst
        }
        style = "bold" if name == "proposal" else None
        table.add_row(
            name,
            str(sensors[name]),
            *([prices.get(name, "")] if prices else []),
            *(cells.get(label, "") for label in labels),
            *(least.get(label, "") for label in worst),
            *(of_setup.get(name, "") for of_setup in dark.values()),
            style=style,
        )
    title = f"Coverage ζ in percent: the share of a volume that at least one sensor sees ({where})"
    poses = " Each figure is the mean over the poses" if any(r.worst for r in results) else ""
    poses += "; worst: the pose with the least coverage." if worst else "." * bool(poses)
    below = target_legend(results) + poses + (f" {DARK[0].upper()}{DARK[1:]}." if dark else "")
    return Explained(title, table, below)


def count_error_line(voxel: float) -> str:
    """Return a sentence about the errors of counts with voxels of ``voxel`` m."""
    return (
        f"±: the error of a count with voxels of {1000 * voxel:g} mm, kept with a probability of"
        " 99.9 %; place-rings verify --rule certified computes a guaranteed interval."
    )
