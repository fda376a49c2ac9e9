"""Report of detection in time: the formula with every term, the sensors' ranges, and shares by
direction.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..coverage.definitions.escaping import printable_lines
from ..formats.schema.separation_models import SafetyResult, ShareModel
from ..simulation.detection import Approaches
from ..simulation.motion_samples import STEP, Moments
from .pages import table

DISCLAIMER = (
    "place-rings is an engineering aid. Nothing here confers a safety rating: the sensors of its"
    " catalogue are not safety-rated, and coverage is not detection. Compliance with the standards"
    " for protective devices (ISO 13855, ISO 10218-2, IEC 61496) must be demonstrated on the real"
    " cell by those responsible for it."
)


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
            "due_m": number(found.asked[k]),
            "in_time": int(found.in_time[k]),
        }
        for k in range(len(found.azimuth))
    ]


def page(r: SafetyResult, command: str) -> str:
    """Return the report as Markdown."""
    lines = [
        *_summary(r),
        *_required_separation(r),
        *_sensor_ranges(r),
        *_directions(r),
        f"Command: `{command}`, seed {r.seed}.",
        "",
    ]
    return printable_lines("\n".join(lines))


def _summary(r: SafetyResult) -> list[str]:
    """Return the title, and the share of approaches that are reported in time."""
    share = (
        f"**{r.in_time.percent:.1f} %** ({r.in_time.low_percent:.1f} to"
        f" {r.in_time.high_percent:.1f})"
    )
    return [
        f"# Detection in time: {r.setup}",
        "",
        f"> {r.disclaimer}",
        "",
        (
            f"A person of 1.75 m walks straight at the robot at {r.separation.human_speed:g} m/s,"
            f" {r.approaches} times, from directions drawn uniformly{_during(r)}. {share} of these"
            " approaches are reported before any part of the robot is nearer than its separation"
            " distance. The range in brackets is the 95 % interval (Wilson)."
        ),
        "",
        f"{r.never_reported} approaches are not reported before contact.",
        "",
        "![Shares by direction, distances, and the approaches that are reported last](safety.png)",
        "",
    ]


def _required_separation(r: SafetyResult) -> list[str]:
    """Return the section on the formula and its terms."""
    s = r.separation
    return [
        "## Required separation",
        "",
        (
            "S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d + Z_r (ISO/TS 15066, now in"
            " ISO 10218-2:2025). Each quarter of each link has its own speed v_r, which is assumed"
            " to point at the person."
        ),
        "",
        table(("term", "value", "meaning", "source"), _terms(r)),
        (
            f"Over the motion S is {s.least_m:.2f} to {s.largest_m:.2f} m. The simulation models"
            " the period and latency of the sensors explicitly. Only the remaining"
            f" {max(s.reaction_s - r.period_s - r.latency_s, 0):.3f} s of T_r therefore count in"
            f" its S (at most {r.separation_at_report_m:.2f} m)."
        ),
        "",
    ]


def _sensor_ranges(r: SafetyResult) -> list[str]:
    """Return the section on the sensors' ranges."""
    lines = [
        "## Range of the sensors",
        "",
        _reach(r),
        "",
        (
            "A person who stays in a beam for one period is reported at most"
            f" {1000 * (r.period_s + r.latency_s):.0f} ms after entering it: a period of"
            f" {1000 * r.period_s:.0f}"
            f" ms{' (assumed: no rate is known)' if r.rate_assumed else ''} and a latency"
            f" of {1000 * r.latency_s:.0f} ms. {_in_the_way(r)}"
        ),
        "",
        *_sensors(r),
    ]
    far = r.if_far_enough
    if far is not None:
        lines += [
            (
                f"If the same beams had a range of {r.range_needed_m:.2f} m, {far.percent:.1f} %"
                f" ({far.low_percent:.1f} to {far.high_percent:.1f}) would be in time. The rest is"
                " missed between the beams, not beyond their range."
            ),
            "",
        ]
    return lines


def _directions(r: SafetyResult) -> list[str]:
    """Return the section on the shares by direction."""
    each = [
        (f"{d.from_deg:.0f}–{d.to_deg:.0f}", str(d.approaches), f"{d.percent:.1f}", _interval(d))
        for d in r.by_direction
    ]
    heads = ("direction, °", "approaches", "in time, %", "95 % interval")
    return ["## By direction", "", table(heads, each)]


def _interval(d: ShareModel) -> str:
    return f"{d.low_percent:.1f}–{d.high_percent:.1f}"


def _during(r: SafetyResult) -> str:
    if r.seconds_of_motion is None:
        return f", each at a fixed pose, drawn by weight from {r.moments} poses"
    return (
        ", while the robot moves; walks end at moments drawn uniformly from"
        f" {r.seconds_of_motion:.1f} s of motion, which repeats"
    )


def _in_the_way(r: SafetyResult) -> str:
    blind = " and blinds one-zone sensors whose beams it enters" if r.occlusion == "blind" else ""
    robot = f"The person walks on a floor at z = {r.floor_m:g} m in the base frame."
    verb = "does not occlude" if r.occlusion == "ignore" else "occludes"
    robot += f" The robot {verb} the space behind it{blind}."
    if not r.obstacles:
        return robot
    return (
        f"{robot} These obstacles occlude, too, but do not block walking: {', '.join(r.obstacles)}."
    )


def _terms(r: SafetyResult) -> list[tuple[str, str, str, str]]:
    s = r.separation
    speed = (
        "joint speeds along the motion"
        if s.speeds_known
        else "robot_speed for all parts: joint speeds are unknown"
    )
    return [
        ("v_h", f"{s.human_speed:g} m/s", "speed of the person", "ISO 13855: walking"),
        ("v_r", f"0 to {s.fastest_m_s:.2f} m/s", "speed of the part of the robot", speed),
        ("T_r", f"{s.reaction_s:g} s", "time from detection to the stop command", "given"),
        (
            "T_s",
            f"{s.stopping_s:g} s at the fastest",
            "time from the stop command to standstill",
            "given, or UR10 CB3 manual 1.6.2 by speed",
        ),
        (
            "S_h",
            f"{s.S_h:.3f} m",
            "the person's path during reaction and stop",
            "v_h (T_r + T_s)",
        ),
        ("S_r", f"{s.S_r:.3f} m", "the robot's path before it brakes", "v_r T_r"),
        ("S_s", f"{s.S_s:.3f} m", "the robot's path while it brakes", "v_r T_s / 2"),
        ("C", f"{s.C:g} m", "intrusion distance", "given"),
        ("Z_d", f"{s.Z_d:g} m", "uncertainty of the person's position", "given"),
        ("Z_r", f"{s.Z_r:g} m", "uncertainty of the robot's position", "given"),
        ("**S**", f"**{s.largest_m:.3f} m**", "separation distance of the fastest part", "the sum"),
    ]


def _reach(r: SafetyResult) -> str:
    if r.range_m >= r.range_needed_m:
        return (
            f"The sensors reach {r.range_m:.2f} m, at least the {r.range_needed_m:.2f} m that the"
            " fastest part requires."
        )
    return (
        f"**The sensors reach {r.range_m:.2f} m. The fastest part requires {r.range_needed_m:.2f}"
        f" m; {r.range_m:.2f} m suffice at {r.range_suffices_percent:.0f} % of the moments.** At"
        " the other moments, sensors on the fastest part detect a person too late, whatever their"
        " direction. Slow the robot down, shorten its stop, or choose sensors with a longer range."
    )


def _sensors(r: SafetyResult) -> list[str]:
    if not r.sensors:
        return [
            (
                "The sensor is not in the catalogue: its nominal range is used, for any target"
                " and light."
            ),
            "",
        ]
    lines = []
    for one in r.sensors:
        lines += [f"{one.title}, {one.range_m:.3f} m ({one.source}):", ""]
        rules = [
            (
                rule.rule,
                rule.found,
                f"{rule.range_m:.3f}",
                "measurement" if rule.measured else "law",
            )
            for rule in one.rules
        ]
        lines.append(table(("rule", "value", "range after it, m", "basis"), rules))
    return lines
