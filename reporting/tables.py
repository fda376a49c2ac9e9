"""Tables for the terminal."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from ..coverage.definitions.units import degrees
from ..coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.robots.robot import Robot
from ..coverage.targets.target import Target, key_text
from ..objectives.redundancy import Loss
from ..objectives.robustness import RingSensitivity, Robustness
from ..objectives.scene import Scene
from ..objectives.verified import LowestPose, PoseZeta, Verified
from .explained import Explained
from .text import counted, coverage_caption, with_error

_WIDE = 3  # at most this many targets: the worst pose gets columns of its own


def ring_table(
    setup: Setup, robot: Robot, sensitivity: Sequence[RingSensitivity] = ()
) -> Explained:
    """Return a table of rings: link, position, sensors, tilt, phase, and what errors of these cost
    where that is known."""
    costs = ("points/mm", "points/°") if sensitivity else ()
    known = {(e.link, e.position): (100 * e.per_mm, 100 * e.per_degree) for e in sensitivity}
    each = [known.get((r.link, r.position)) for r in setup.rings]
    none, rows = ["–" for _ in costs], []
    for i, r in enumerate(setup.rings):
        length = robot.mount(r.link).length
        place = ("flange", "–")
        if length > 0:
            place = (f"{r.position:.3f}", f"{1000 * r.position * length:.0f}")
        angles = (f"{math.degrees(r.tilt):+.1f}", f"{math.degrees(r.phase):.1f}")
        cost = [f"{a:.3f}" for a in each[i] or ()] or none
        rows.append([str(i), r.link, *place, str(r.count), *angles, *cost])
    for i, single in enumerate(setup.singles, start=len(setup.rings)):
        rows.append([str(i), single.link, "single", "–", "1", "–", "–", *none])
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
    heads = ("ring", "link", "position", "mm", "sensors", "tilt °", "phase °", *costs)
    title = f"{counted(len(setup.rings), 'ring')}, {counted(setup.sensors, 'sensor')}"
    return Explained.of(title, heads, rows, below, left=("link",))


def target_label(result: Verified | Robustness) -> str:
    """Return a target's label: ``V_S(0.5)`` or ``V_OT``."""
    return key_text(*result.key)


def result_caption(result: Verified) -> str:
    """Return the coverage of a record's target as a caption."""
    dark = None if result.dark_clothing is None else 100 * result.dark_clothing
    return coverage_caption(target_label(result), 100 * result.zeta, dark)


def percent(result: Verified | PoseZeta | LowestPose, rule: str) -> str:
    """Return ζ in percent with its error, or its certified interval, rounded outward."""
    if rule == "certified":
        low, high = 100 * result.low, 100 * result.high
        decimals = min(max(2, 1 - math.floor(math.log10(max(high - low, 1e-9)))), 8)
        low = math.floor(low * 10**decimals) / 10**decimals
        high = math.ceil(high * 10**decimals) / 10**decimals
        return f"{low:.{decimals}f} … {high:.{decimals}f}"
    return with_error(100 * result.zeta, result.error)


def percent_under(result: Verified, model: Occlusion) -> str:
    """Return ζ in percent under a model of occlusion, with its error."""
    return with_error(100 * result.by_occlusion[model], result.by_occlusion_error.get(model))


_TARGETS = {
    "V_S": "V_S(r): discs of r m across the arm's centre line, cut flat at the tool",
    "V_N": "V_N(r): everything within r m of the robot's bodies",
    "V_O": "V_O: sphere of the robot's reach",
    "V_T": "V_T: sphere around the tool, of 1.5 m unless the scene says otherwise",
    "V_OT": "V_OT: V_O and V_T together",
    "V_P": "V_P: protective volume of ISO 10218-2:2025 (form of ISO/TS 15066)",
}


def target_legend(results: Sequence[Verified | Robustness]) -> str:
    """Return a sentence that explains the targets of the results."""
    names = {r.key[0] for r in results}
    lines = [text for name, text in _TARGETS.items() if name in names]
    return "; ".join(lines) + "." if lines else ""


def target_meaning(target: Target, scene: Scene) -> str:
    """Return what a target is: ``V_T is all points within 1.5 m of the tool``."""
    radius = getattr(target, "radius", 0)
    named = {
        "V_O": f"all points within {scene.robot.reach:g} m of the base",
        "V_T": f"all points within {scene.curve.tcp_range:g} m of the tool",
        "V_OT": (
            f"all points within {scene.robot.reach:g} m of the base or {scene.curve.tcp_range:g} m"
            " of the tool"
        ),
        "V_S": f"the discs of {radius:g} m across the arm's centre line, cut flat at the tool",
        "V_N": f"all points within {radius:g} m of the robot's bodies",
        "V_P": "all points within the separation distance of ISO 10218-2:2025 (form of"
        " ISO/TS 15066)",
    }
    what = named[target.name] if target.named else target.described()
    return f"{target} is {what}"


DARK = "dark clothing: with the sensors' range on cloth of 17 % at their light"


def dark_columns(results: Sequence[Verified]) -> dict[str, dict[str, str]]:
    """Return ζ for dark clothing in percent by the target's label and the setup, of those targets
    for which it is known."""
    known: dict[str, dict[str, str]] = {}
    for r in results:
        if r.dark_clothing is not None:
            known.setdefault(target_label(r), {})[r.setup] = f"{100 * r.dark_clothing:.2f}"
    return known


_MODELS: dict[Occlusion, str] = {
    "ignore": "ignore: beams pass through the robot",
    "shadow": "shadow: points behind the robot's body are not covered",
    "returns": "returns: a one-zone sensor covers nothing too near behind a body in its beam, and"
    " nothing beyond the one that takes its last target",
    "blind": "blind: a one-zone sensor covers nothing beyond the nearest surface in its beam",
}


@dataclass(frozen=True)
class _Compared:
    """The first columns of a table of setups; the setup ``proposal`` is bold."""

    sensors: Mapping[str, int]
    """Number of sensors of each setup."""
    where: str
    """Scene and way to count, for the title."""
    prices: Mapping[str, str]
    """Price of each setup, as text; none without prices."""

    def table(
        self,
        results: Sequence[Verified],
        columns: Mapping[str, Mapping[str, str]],
        below: str,
    ) -> Explained:
        """Return a table with a row for each setup of ``results``; ``columns`` are cells by head
        and setup."""
        columns = ({"price": self.prices} if self.prices else {}) | dict(columns)
        rows = [
            [name, str(self.sensors[name]), *(cells.get(name, "") for cells in columns.values())]
            for name in dict.fromkeys(r.setup for r in results)
        ]
        title = "Coverage ζ in percent: the share of a volume that at least one sensor sees"
        heads = ("setup", "sensors", *columns)
        title = f"{title} ({self.where})"
        return Explained.of(title, heads, rows, below, left=("setup",), bold=("proposal",))


def zeta_table(
    results: Sequence[Verified],
    sensors: Mapping[str, int],
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
    columns: dict[str, dict[str, str]] = {}
    worst: dict[str, dict[str, str]] = {}
    for r in results:
        label = target_label(r)
        columns.setdefault(label, {})[r.setup] = percent(r, r.rule)
        if r.worst:
            worst.setdefault(f"{label} worst", {})[r.setup] = percent(r.worst, r.rule)
    worst = worst if len(columns) <= _WIDE else {}
    dark = {f"{label} dark clothing": cells for label, cells in dark_columns(results).items()}
    poses = " Each figure is the mean over the poses" if any(r.worst for r in results) else ""
    poses += "; worst: the pose with the least coverage." if worst else "." * bool(poses)
    below = target_legend(results) + poses + (f" {DARK[0].upper()}{DARK[1:]}." if dark else "")
    return _Compared(sensors, where, prices).table(results, columns | worst | dark, below)


def occlusion_table(
    results: Sequence[Verified],
    sensors: Mapping[str, int],
    where: str,
    prices: Mapping[str, str] = MappingProxyType({}),
) -> Explained | None:
    """Return ζ with a row for each setup and a column for each target and model of occlusion, the
    scene's own model first; None if the models were not counted. Arguments: see ``zeta_table``."""
    shown = [r for r in results if r.by_occlusion]
    if not shown:
        return None
    own, columns = shown[0].occlusion, dict[str, dict[str, str]]()
    common = [m for m in OCCLUSIONS if all(m in r.by_occlusion for r in shown)]
    models = [own, *(m for m in common if m != own)]
    faulty = {r.setup: len(r.unmounted) for r in results if r.by_occlusion}
    if any(faulty.values()):
        columns["rings not mountable"] = {n: str(rings or "–") for n, rings in faulty.items()}
    dark = dark_columns(shown)
    for label in dict.fromkeys(target_label(r) for r in shown):
        mine = [r for r in shown if target_label(r) == label]
        for model in models:
            columns[f"{label} {model}"] = {r.setup: percent_under(r, model) for r in mine}
            if model == own and label in dark:
                columns[f"{label} dark clothing"] = dark[label]
    legend = filter(None, [target_legend(shown)[:-1]])
    below = "; ".join([*legend, *(_MODELS[m] for m in models), *[DARK] * bool(dark)]) + "."
    return _Compared(sensors, where, prices).table(shown, columns, below)


def coverage_tables(
    results: Sequence[Verified],
    sensors: Mapping[str, int],
    where: str,
    prices: Mapping[str, str] = MappingProxyType({}),
) -> list[Explained]:
    """Return the tables of ζ that are worth printing: ``occlusion_table`` where the models were
    counted, and ``zeta_table`` where they were not or for the worst pose."""
    seen = occlusion_table(results, sensors, where, prices)
    tables = [] if seen is None else [seen]
    if seen is None or any(r.worst for r in results):
        tables.insert(0, zeta_table(results, sensors, where, prices))
    return tables


def count_error_line(voxel: float) -> str:
    """Return a sentence about the errors of counts with voxels of ``voxel`` m."""
    return (
        f"±: the error of a count with voxels of {1000 * voxel:g} mm, kept with a probability of"
        " 99.9 %; place-rings verify --rule certified computes a guaranteed interval."
    )


def robustness_rows(results: Sequence[Robustness]) -> list[list[str]]:
    """Return rows with a label and one cell in percent for each target."""
    e = results[0].errors
    mountings = (
        f"{e.draws} mountings, ±{1000 * e.position:g} mm,"
        f" ±{degrees(e.direction):g}°{' (2 σ)' if e.law == 'normal' else ''}"
    )
    several = range(2, len(results[0].seen) + 1)
    rows = {
        "ζ": [r.zeta for r in results],
        **{f"covered by at least {k} sensors": [r.seen[k - 1] for r in results] for k in several},
        "ζ without the worst sensor": [r.worst_sensor.zeta for r in results],
        "ζ without the worst ring": [r.worst_ring.zeta for r in results],
        f"mean ζ of {mountings}": [r.mean for r in results],
        "5th percentile of these mountings": [r.fifth_percentile for r in results],
    }
    return [[what, *(f"{100 * v:.2f}" for v in values)] for what, values in rows.items()]


def robustness_table(results: Sequence[Robustness]) -> Explained:
    """Return the same rows as a table for the terminal."""
    first = results[0]
    title = f"{first.setup}: coverage ζ in percent (rule sampled, voxels of {first.voxel:g} m)"
    return Explained.of(
        title,
        ("", *map(target_label, results)),
        robustness_rows(results),
        "worst: the sensor or ring whose loss costs most; mountings: random errors of position and"
        f" direction. {target_legend(results)}",
        left=("",),
    )


def losses_line(r: Robustness) -> str:
    """Return a line on the most important sensor and ring, and on the Monte Carlo error."""

    def lost(loss: Loss) -> str:
        if loss.single:
            return loss.single
        ring = f"ring {loss.ring} on {loss.link}"
        return ring if loss.sensor is None else f"sensor {loss.sensor} of {ring}"

    error = "" if r.mean_error is None else f" ± {100 * r.mean_error:.2f} (standard error)"
    return (
        f"largest losses: {lost(r.worst_sensor)} and {lost(r.worst_ring)}; mean under mounting"
        f" errors {100 * r.mean:.2f}{error}, minimum {100 * r.worst:.2f}; {r.seconds:.1f} s"
    )
