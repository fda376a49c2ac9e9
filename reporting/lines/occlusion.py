"""Lines and tables about occlusion: ζ under all models, advice, and sensors that cover nothing."""

from collections.abc import Sequence
from itertools import groupby

from rich.table import Table

from ...coverage.occlusion.occlusion_mode import OCCLUSIONS
from ...coverage.rings.ring import Setup
from ...formats.schema.result_models import UnseeingModel, VerifyResult
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.mounting import REAL
from ...objectives.feasibility.violations import faults
from ...objectives.scene import CoreScene
from ..explained import Explained
from ..tables import target_label
from ..terminal import Terminal

ADVICE = (
    "On a real mount the robot's body occludes sensors. Use shadow for multi-zone sensors and"
    " blind for one-zone sensors, which report the body itself; ignore reproduces the paper."
)


def mounting_lines(scene: CoreScene, setup: Setup) -> list[str]:
    """Return the violated mount rules of a setup if the scene has real mounts, and boards that do
    not fit.
    """
    real = REAL if scene.real else ()
    return [fault.text for fault in faults(scene, setup.rings) if fault.rule in (*real, "printing")]


def without_lines(scene: CoreScene, setup: Setup) -> list[str]:
    """Return a line for each link that has no ring because none is clear anywhere on it."""
    if not scene.real:
        return []
    clear, bare = (
        MountClearance(scene),
        [link for link in scene.robot.links if link not in {r.link for r in setup.rings}],
    )
    barred = [
        (link, radius) for link in bare if not clear.stretches(link, radius := clear.radius(link))
    ]
    return [f"No ring on {link}: {clear.why(link, radius)}." for link, radius in barred]


def occlusion_table(results: Sequence[VerifyResult]) -> Explained | None:
    """Return ζ with a row for each setup and a column for each target and model of occlusion.

    Returns:
        None if the models were not counted.
    """
    shown = [r for r in results if r.by_occlusion_percent]
    if not shown:
        return None
    table = Table()
    table.add_column("setup")
    labels = list(dict.fromkeys(target_label(r) for r in shown))
    for label in labels:
        for model in OCCLUSIONS:
            table.add_column(f"{label} {model}", justify="right")
    for name in dict.fromkeys(r.setup for r in shown):
        mine = {target_label(r): r.by_occlusion_percent for r in shown if r.setup == name}
        cells = [
            f"{mine[label][m]:.2f}" if label in mine else "" for label in labels for m in OCCLUSIONS
        ]
        table.add_row(name, *cells, style="bold" if name == "proposal" else None)
    return Explained(
        "Coverage ζ in percent under each occlusion model",
        table,
        "ignore: beams pass through the robot; shadow: points behind its body are not covered;"
        " blind: a one-zone sensor covers nothing beyond the nearest surface in its beam.",
    )


def unseeing_lines(found: Sequence[UnseeingModel]) -> list[str]:
    """Return a line for each ring with sensors that cover nothing, and for each body that they lie
    in.
    """
    lines = []
    order = sorted(found, key=lambda u: (u.within or "", u.ring, u.sensor))
    for (within, ring), some in groupby(order, key=lambda u: (u.within, u.ring)):
        each = list(some)
        sensors = ", ".join(str(u.sensor) for u in each)
        who = f"Ring {ring}, sensor{'s' * (len(each) > 1)} {sensors}"
        if within is None:
            lines.append(f"{who}: less than 1 % of the cone is unobstructed.")
        else:
            deep = max(u.depth_mm for u in each)
            lines.append(f"{who}: up to {deep:.0f} mm inside {within}; no coverage beyond it.")
    return lines


def scene_lines(scene: CoreScene) -> list[str]:
    """Return a line for each obstacle whose convex hull replaces it because it is not convex."""
    return [
        f"Obstacle {o.name} is not convex; its convex hull is used."
        for o in scene.obstacles
        if o.hulled
    ]


def print_sight(
    console: Terminal,
    results: Sequence[VerifyResult],
    blind: Sequence[UnseeingModel],
    scene: CoreScene,
    mount: Sequence[str] = (),
) -> None:
    """Print ζ under all models of occlusion and what limits the view.

    Args:
        console: terminal to print on.
        results: counts of all setups.
        blind: sensors that cover nothing.
        scene: scene of the counts, for obstacles that are replaced by their hulls.
        mount: lines about the mount, printed first.
    """
    table = occlusion_table(results)
    if table is not None:
        console.print(table)
    for line in (
        *mount,
        *unseeing_lines(blind),
        *scene_lines(scene),
        *([ADVICE] if table is not None else []),
    ):
        console.print(line, highlight=False, soft_wrap=True)
