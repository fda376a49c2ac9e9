"""A change to a ring as one line of text: what to do to it."""

import math

from .coverage.robots.robot import Robot
from .placement.redesign.changes import Change, ChangeKind, turn


def instruction(change: Change, mounted: int, robot: Robot) -> str:
    """Return what to do to one ring, as one line of text.

    Args:
        change: the change.
        mounted: number of mounted rings; rings from this index on are new.
        robot: robot with the lengths of its links.
    """
    before, after = change.before, change.after
    name = f"ring {change.place}" if change.place < mounted else "new ring"
    if after is None:
        place = f" ({before.link}, {before.count} sensors)" if before else ""
        return f"{name}{place}: remove"
    length = robot.mount(after.link).length
    place = f", {1000 * after.position * length:.0f} mm from its proximal end" if length > 0 else ""
    if before is None:
        angles = f"tilt {_deg(after.tilt)}, phase {math.degrees(after.phase):.1f}°"
        return f"{name}: {after.count} sensors on {after.link}{place}, {angles}"
    does = []
    if change.kind is ChangeKind.CARRIED:
        does.append(f"carry to {after.link}{place}")
    elif change.moved:
        way = "distal" if after.position > before.position else "proximal"
        does.append(
            f"move {1000 * change.moved:.0f} mm towards the {way} end, to{place.removeprefix(',')}"
        )
    if change.tilted:
        does.append(f"tilt {_deg(before.tilt)} → {_deg(after.tilt)}")
    if change.turned:
        does.append(f"turn by {_deg(turn(before, after))}")
    if change.sensors:
        does.append(f"{before.count} → {after.count} sensors")
    return f"{name} ({before.link}): {', '.join(does)}"


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):+.1f}°"
