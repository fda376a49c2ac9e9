"""Report of detection in time: the formula with every term, the sensors' ranges, and shares by
direction.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..coverage.definitions.escaping import printable_lines
from ..simulation.detection import Approaches, ApproachShare
from ..simulation.motion_samples import STEP, Moments
from ..simulation.safety import SafetyResult
from .pages import table
from .text import counted

UNLISTED = (
    "The sensor is not in the catalogue: its nominal range is used, for any target and light."
)
_TEMPLATE = Path(__file__).with_suffix(".md")


def rows(found: Approaches, moments: Moments) -> list[Mapping[str, Any]]:
    """Return one CSV row for each approach.

    Distances are in m, and empty where no report came before contact.
    """

    def number(value: float) -> Any:
        return round(float(value), 4) if np.isfinite(value) else ""

    return [
        {
            "azimuth_deg": round(float(np.degrees(found.azimuth[k])) % 360, 3),
            "end_of_walk": (
                round(STEP * int(found.moment[k]), 3) if moments.together else int(found.moment[k])
            ),
            "first_sight_m": number(found.sight[k]),
            "first_report_m": number(found.report[k]),
            "due_m": number(found.due[k]),
            "in_time": int(found.in_time[k]),
        }
        for k in range(len(found.azimuth))
    ]


def page(r: SafetyResult, command: str) -> str:
    """Return the report as Markdown."""
    s, far = r.separation, r.if_far_enough
    each = [
        (
            f"{d.from_deg:.0f}–{d.to_deg:.0f}",
            str(d.approaches),
            f"{100 * d.share:.1f}",
            _between(d, "–"),
        )
        for d in r.by_direction
    ]
    text = _TEMPLATE.read_text("utf-8").format(
        r=r,
        s=s,
        in_time=f"**{100 * r.in_time.share:.1f} %** ({_between(r.in_time)})",
        command=command,
        during=_during(r),
        speeds="joint speeds along the motion"
        if s.speeds_known
        else "robot_speed for all parts: joint speeds are unknown",
        stopping=_stopping(r),
        remaining_s=max(s.reaction_s - r.period_s - r.latency_s, 0),
        reach=_reach(r),
        late_ms=1000 * (r.period_s + r.latency_s),
        period_ms=1000 * r.period_s,
        latency_ms=1000 * r.latency_s,
        assumed=" by the firing schedule" * r.scheduled
        + " (assumed: no rate is known)" * r.rate_assumed,
        occlusion=_in_the_way(r),
        sensors="\n".join(_sensors(r)),
        farther="" if far is None else f"{_farther(r, far)}\n\n",
        directions=table(("direction, °", "approaches", "in time, %", "95 % interval"), each),
    )
    return printable_lines(text)


def _between(share: ApproachShare, to: str = " to ") -> str:
    return f"{100 * share.low:.1f}{to}{100 * share.high:.1f}"


def _farther(r: SafetyResult, far: ApproachShare) -> str:
    return (
        f"If the same beams had a range of {r.range_needed_m:.2f} m, {100 * far.share:.1f} %"
        f" ({_between(far)}) would be in time. The rest is missed"
        " between the beams, not beyond their range."
    )


def _during(r: SafetyResult) -> str:
    if r.seconds_of_motion is None:
        return f", each at a fixed pose, drawn by weight from {r.moments} poses"
    return (
        ", while the robot moves; walks end at moments drawn uniformly from"
        f" {r.seconds_of_motion:.1f} s of motion, which repeats"
    )


def _stopping(r: SafetyResult) -> str:
    if not r.stops:
        return "given, or UR10 CB3 manual 1.6.2 by speed"
    count = sum(one.measurements for one in r.stops)
    return f"largest of {counted(count, 'measured stop')} of the user's robot"


def _in_the_way(r: SafetyResult) -> str:
    also = {
        "blind": " and blinds one-zone sensors whose beams it enters",
        "returns": " and takes targets of one-zone sensors whose beams it enters",
    }.get(r.occlusion, "")
    verb = "does not occlude" if r.occlusion == "ignore" else "occludes"
    robot = f"The robot {verb} the space behind it{also}."
    if not r.obstacles:
        return robot
    names = ", ".join(r.obstacles)
    return f"{robot} These obstacles occlude, too, but do not block walking: {names}."


def _reach(r: SafetyResult) -> str:
    if r.range_m >= r.range_needed_m:
        return (
            f"The sensors reach {r.range_m:.2f} m, at least the {r.range_needed_m:.2f} m that the"
            " fastest part requires."
        )
    return (
        f"**The sensors reach {r.range_m:.2f} m. The fastest part requires {r.range_needed_m:.2f}"
        f" m; {r.range_m:.2f} m suffice at {100 * r.range_suffices:.0f} % of the moments.** At"
        " the other moments, sensors on the fastest part detect a person too late, whatever their"
        " direction. Slow the robot down, shorten its stop, or choose sensors with a longer range."
    )


def _sensors(r: SafetyResult) -> list[str]:
    if not r.sensors:
        return [f"{UNLISTED}\n"]
    lines = []
    for one in r.sensors:
        lines += [f"{one.title}, {one.range_m:.3f} m ({one.source}):", ""]
        rules = [
            (rule.rule, rule.found, f"{rule.range_m:.3f}", ("law", "measurement")[rule.measured])
            for rule in one.rules
        ]
        lines.append(table(("rule", "value", "range after it, m", "basis"), rules))
    return lines
