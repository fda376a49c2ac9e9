"""Lines and tables about occlusion: ζ under all models, advice, and sensors that cover nothing."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby

from ...coverage.electronics.electronics import most_on_ring, unknown_reason
from ...coverage.rings.ring import Setup
from ...coverage.rings.surface_lift import Lift
from ...coverage.robots.base_frame import base_frame, frame_text
from ...coverage.robots.joint_values import radians_of
from ...coverage.sensors.effective_range import model_of
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
    " the robot's body itself; returns for those that report several targets. --paper counts as the"
    " paper does."
)
ASSUMPTIONS = {
    "ignore": "beams pass through the robot, as in the paper",
    "shadow": "points behind the body are not covered, as for multi-zone sensors",
    "returns": "bodies in the beam of a one-zone sensor take its targets, and hide what is too near"
    " behind them",
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
    if scene.base is not None or base_frame(scene.robot) is None or not states_coordinates(scene):
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
    console.lines(*mount, *unseeing_lines(blind), *scene_lines(scene), *[ADVICE] * counted_all)


def record_line(scene: Scene) -> str | None:
    """Return a line about the recorded motion behind the poses, or None if they come from no
    record.
    """
    r = scene.recorded
    if r is None:
        return None
    weight = (
        "dwell time"
        if r.speed_weight == 0
        else f"dwell time and speed (speed_weight {r.speed_weight:g})"
    )
    chain, slides = scene.robot.chain, ""
    if chain.prismatic:
        metres = r.within / radians_of(chain)[chain.prismatic[0]]
        slides = f" (prismatic joints: {1000 * metres:.0f} mm)"
    return (
        f"{r.file}: {r.rows:,} rows over {r.seconds:.1f} s, reduced to {len(scene.poses)} poses"
        f" weighted by {weight}; every row lies within {math.degrees(r.within):.1f}°{slides}"
        " of its pose in every joint."
    )


def electronics_lines(scene: Scene) -> list[str]:
    """Return a line for each catalogue sensor of new rings that nothing limits, and one for each
    that its electronics limit to fewer sensors than the rules."""
    lines = dict[str, None]()
    for link in scene.robot.links if scene.real else ():
        sensor = scene.sensor_of(link)
        if sensor.use is None:
            continue
        name, most = model_of(sensor.use).name, scene.rules.sensors[1]
        carried = most_on_ring(scene.electronics, sensor, scene.radius_of(link))
        if reason := unknown_reason(scene.electronics, sensor):
            lines[f"Electronics do not limit the rings: {reason}."] = None
        elif carried is not None and carried < most:
            lines[f"Electronics: a ring carries at most {carried} {name}."] = None
    return list(lines)


def lift_lines(lifts: Sequence[Lift], most_mm: float) -> Iterator[str]:
    """Yield a line about the lifted sensors, and one about those that stay in a body.

    Args:
        lifts: the sensors that lie in a body.
        most_mm: largest distance of a lift, mm.
    """
    moved = [lift for lift in lifts if lift.lifted]
    if not lifts:
        yield "No sensor lies in a body of its own link; none was lifted."
    if moved:
        each = ", ".join(
            f"{lift.sensor.label} {1000 * lift.distance:.1f} mm out of {lift.body}"
            for lift in moved
        )
        yield f"Lifted along their axes to the surface: {each}."
    if len(moved) < len(lifts):
        each = ", ".join(f"{lift.sensor.label} in {lift.body}" for lift in lifts if not lift.lifted)
        yield f"Deeper than {most_mm:g} mm, so they stay and see nothing: {each}."


def price_line(scene: Scene, setup: Setup) -> str | None:
    """Return the price of a setup with its parts; None for a scene without prices."""
    prices, price = scene.prices, scene.price_of(setup)
    if prices is None or price is None:
        return None
    new = [ring for ring in setup.rings if ring not in scene.rules.fixed]
    parts = [f"{counted(len(new), 'ring')} at {prices.text(prices.ring)}"]
    sensors = Counter[float]()
    for ring in new:
        sensors[prices.of_sensor(ring.sensor)] += ring.count
    parts += [f"{counted(n, 'sensor')} at {prices.text(each)}" for each, n in sensors.items()]
    fixed = "; fixed rings cost nothing" if len(new) < len(setup.rings) else ""
    return f"Price: {prices.text(price.total)} ({', '.join(parts)}{fixed})."
