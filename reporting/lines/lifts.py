"""Lines about sensors that were lifted out of the body in which they lay."""

from collections.abc import Iterator, Sequence

from ...coverage.rings.surface_lift import Lift


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
