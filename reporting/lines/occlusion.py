"""Lines and tables about occlusion: ζ under all models, advice, and sensors that cover nothing."""

import math
from collections.abc import Sequence
from itertools import groupby

from ...coverage.rings.ring import Setup
from ...coverage.robots.base_frame import base_frame, frame_text
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.violations import otherwise_tilted
from ...objectives.occlusion import Unseeing
from ...objectives.scene import Scene
from ...objectives.turned_cell import states_coordinates
from ...objectives.verified import Verified
from ...objectives.verify_breakdown import PARTS
from ..tables import target_label
from ..terminal import Terminal
from ..text import counted

ADVICE = (
    "Use --occlusion shadow for multi-zone sensors, and blind for one-zone sensors, which report"
    " the robot's body itself. --paper counts as the paper does."
)
ASSUMPTIONS = {
    "ignore": "beams pass through the robot, as in the paper",
    "shadow": "points behind the body are not covered, as for multi-zone sensors",
    "blind": "the body blocks any sensor whose beam it enters, as for one-zone sensors",
}


def without_lines(scene: Scene, setup: Setup) -> list[str]:
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


def shared_tilt_line(scene: Scene, setup: Setup) -> str | None:
    """Return a line that names the fixed rings with another tilt than the shared one; None if there
    are none."""
    rings = setup.rings
    each = [
        f"ring {i} ({rings[i].link}, {math.degrees(rings[i].tilt):.1f}°)"
        for i in otherwise_tilted(scene, rings)
    ]
    if not each:
        return None
    return f"The fixed rings stay as they are: not at the shared tilt are {', '.join(each)}."


def unmounted_lines(results: Sequence[Verified]) -> list[str]:
    """Return a line for each setup with rings that could not be mounted, with the reasons."""
    reasons = {r.setup: (len(r.unmounted), r.mounting) for r in results if r.unmounted}
    return [
        f"{name}: {counted(rings, 'ring')} cannot be mounted: {'; '.join(why)}."
        for name, (rings, why) in reasons.items()
    ]


def unseeing_lines(found: Sequence[Unseeing]) -> list[str]:
    """Return a line for each ring with sensors that cover nothing, and for each body that they lie
    in.
    """
    lines = []
    order = sorted(found, key=lambda u: (u.within or "", u.ring, u.sensor))
    for (within, ring), some in groupby(order, key=lambda u: (u.within, u.ring)):
        each = list(some)
        sensors = ", ".join(str(u.sensor) for u in each)
        who = f"Ring {ring}, sensor{'s' * (len(each) > 1)} {sensors}"
        if single := each[0].single:
            who = single[0].upper() + single[1:]
        if within is None:
            lines.append(f"{who}: less than 1 % of the cone is unobstructed.")
        else:
            deep = 1000 * max(u.depth for u in each)
            lines.append(f"{who}: up to {deep:.0f} mm inside {within}; no coverage beyond it.")
    return lines


def scene_lines(scene: Scene) -> list[str]:
    """Return lines about a robot without bodies, about a base frame that was not stated, and about
    obstacles that are not convex, whose convex hulls replace them."""
    bodiless = (
        f"Robot {scene.robot.name} has no bodies: beams pass through it, and rings need no room on"
        " it. place-rings robot fits bodies to a URDF."
    )
    return (
        [bodiless] * (not scene.robot.bodies)
        + base_lines(scene)
        + [
            f"Obstacle {o.name} is not convex; its convex hull is used."
            for o in scene.obstacles
            if o.hulled
        ]
        + [
            f"Attached {one.name} is not convex; its convex hull is used."
            for one in scene.robot.attached
            if one.hulled
        ]
    )


def part_lines(results: Sequence[Verified]) -> list[str]:
    """Return what each part of a mixed system covers alone, and what the rings add to the rest."""
    lines = []
    for r in results:
        parts = dict(r.by_part)
        if not parts:
            continue
        each = ", ".join(f"{part} {100 * zeta:.2f}" for part, zeta in parts.items())
        line = f"{target_label(r)} by each part alone, in percent: {each}"
        rings, others = parts.pop(PARTS[0], None), list(parts)
        if rings is not None and len(others) == 1:
            added = 100 * (r.zeta - parts[others[0]])
            line += f"; the rings add {added:.2f} points to what the {others[0]} cover"
        lines.append(line + ".")
    return lines


def base_lines(scene: Scene) -> list[str]:
    """Return a line if a UR arm has a cell that half a turn about z would change, and its scene
    states no base frame."""
    if scene.base_stated or base_frame(scene.robot) is None or not states_coordinates(scene):
        return []
    return [
        f"The scene states no base, so its coordinates are in {frame_text(scene.robot)}. base_link"
        ' is the Base of the pendant turned by 180° about z: state base = "pendant" if they were'
        ' read there, or else base = "base_link".'
    ]


def print_sight(
    console: Terminal,
    results: Sequence[Verified],
    blind: Sequence[Unseeing],
    scene: Scene,
    mount: Sequence[str] = (),
) -> None:
    """Print what limits the view.

    Args:
        console: terminal to print on.
        results: counts of all setups.
        blind: sensors that cover nothing.
        scene: scene of the counts, for obstacles that are replaced by their hulls.
        mount: lines about the mount, printed first.
    """
    counted_all = any(r.by_occlusion for r in results)
    for line in (*mount, *unseeing_lines(blind), *scene_lines(scene), *[ADVICE] * counted_all):
        console.print(line, highlight=False, soft_wrap=True)
