"""Tables of a check's report about the rig's health: doubtful sensors, links and their events."""

from ...reporting.pages import escaped, table
from .models import CheckResult


def shown_number(value: float | None, digits: int = 1) -> str:
    """Return a number with ``digits`` decimals; nothing for None."""
    return "" if value is None else f"{value:.{digits}f}"


def doubtful_sensors(r: CheckResult) -> list[str]:
    """List the doubtful sensors with their shares of doubtful readings."""
    rows = [
        (
            escaped(one.sensor),
            str(one.readings),
            *(
                f"{share:.0f}"
                for share in (
                    one.failed_percent,
                    one.missing_percent,
                    one.near_percent,
                    one.apart_percent,
                    one.absent_percent,
                )
            ),
        )
        for one in r.sensors
        if one.doubtful
    ]
    heads = (
        "sensor",
        "readings",
        "failed, %",
        "missing, %",
        "below 5 cm, %",
        "apart, %",
        "absent, %",
    )
    return ["## Doubtful sensors", "", table(heads, rows), ""] if rows else []


def links(r: CheckResult) -> list[str]:
    """Describe the links to the rings and the robot, and their events."""
    rows = [
        (
            *(
                escaped(t)
                for t in (
                    f"{one.ring} {one.link}",
                    "simulated" if r.simulated else one.port,
                    one.decoder,
                    one.serial or "none",
                )
            ),
            *(str(v) for v in (one.frames, one.lost, one.late, one.corrupt, one.restarts)),
            *(shown_number(one.drift_ppm), shown_number(one.jitter_ms, 2)),
        )
        for one in r.lines
    ]
    heads = (
        "ring",
        "port",
        "decoder",
        "board",
        "frames",
        "lost",
        "late",
        "corrupt",
        "restarts",
        "clock, ppm",
        "jitter, ms",
    )
    robot = f"The robot sent {r.robot.states} states in {r.robot.seconds:.1f} s; its clock is"
    clock = (
        f"{robot} {shown_number(r.robot.drift_ppm)} ppm faster than the host's; states arrive with"
        f" a jitter of {shown_number(r.robot.jitter_ms, 2)} ms."
    )
    lines = ["## Links", "", table(heads, rows), clock, ""]
    lines += [
        f"- ring {one.ring}: the first line outside its decoder's grammar: {escaped(one.foreign)}"
        for one in r.lines
        if one.foreign
    ]
    if r.events:
        rows = [
            (f"{e.seconds:.2f}", str(e.ring), escaped(e.what), escaped(e.detail)) for e in r.events
        ]
        lines += ["## Events", "", table(("s", "ring", "what", "detail"), rows)]
    return lines
