"""Lines about a scene and a setup in it: poses, electronics, lifted sensors, prices, targets."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from ...coverage.electronics.electronics import most_on_ring, unknown_reason
from ...coverage.rings.ring import Setup
from ...coverage.rings.surface_lift import Lift
from ...coverage.robots.joint_values import radians_of
from ...coverage.sensors.effective_range import model_of
from ...objectives.scene import Scene
from ..text import counted


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
