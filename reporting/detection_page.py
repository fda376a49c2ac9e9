"""The report of detection in time: the formula with every term, what the sensors see, shares by
direction, and no rating.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..formats.escaping import printable_lines
from ..formats.schema.separation_models import SafetyResult, ShareModel
from ..simulation.detection import Approaches
from ..simulation.moments import STEP, Moments
from .pages import table

DISCLAIMER = (
    "place-rings is an engineering aid. Nothing here confers a safety rating: the sensors of its"
    " catalogue are not safety-rated, and coverage is not detection. What the standards ask of a"
    " protective device (ISO 13855, ISO 10218-2, IEC 61496) is to be shown on the real cell, by"
    " those who answer for it."
)


def rows(found: Approaches, moments: Moments) -> list[Mapping[str, Any]]:
    """Each approach as a row of CSV; distances in m, empty where there was none before contact."""

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
    """The report as Markdown."""
    s = r.separation
    share = (
        f"**{r.in_time.percent:.1f} %** ({r.in_time.low_percent:.1f} to"
        f" {r.in_time.high_percent:.1f})"
    )
    far = r.if_far_enough
    lines = [
        f"# Detection in time: {r.setup}",
        "",
        f"> {r.disclaimer}",
        "",
        (
            f"A person of 1.75 m walks straight at the robot at {s.human_speed:g} m/s,"
            f" {r.approaches} times, from directions drawn evenly{_during(r)}. {share} of these"
            " approaches are reported before any part of the robot is nearer than its separation"
            " distance; in brackets the interval of 95 % after Wilson."
        ),
        "",
        f"{r.never_reported} approaches are not reported before contact.",
        "",
        "![Shares by direction, distances, and the approaches that are reported last](safety.png)",
        "",
        "## What is asked",
        "",
        (
            "S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d + Z_r (ISO/TS 15066, now in ISO"
            " 10218-2:2025), for each quarter of each link by its own speed v_r, taken as if it"
            " were towards the person."
        ),
        "",
        table(("term", "value", "what it is", "from"), _terms(r)),
        (
            f"Over the motion S is {s.least_m:.2f} to {s.largest_m:.2f} m. In the simulation period"
            " and latency of the sensors are counted by themselves, so that"
            f" {max(s.reaction_s - r.period_s - r.latency_s, 0):.3f} s of T_r are left in S there"
            f" (at most {r.separation_at_report_m:.2f} m)."
        ),
        "",
        "## What the sensors see",
        "",
        _reach(r),
        "",
        (
            f"A sight that lasts for a period is reported {1000 * (r.period_s + r.latency_s):.0f}"
            f" ms after it began at most: a period of {1000 * r.period_s:.0f}"
            f" ms{' (assumed: no rate is sourced)' if r.rate_assumed else ''} and"
            f" {1000 * r.latency_s:.0f} ms of latency. {_in_the_way(r)}"
        ),
        "",
        *_sensors(r),
    ]
    if far is not None:
        lines += [
            (
                f"With the same beams seeing as far as {r.range_needed_m:.2f} m, {far.percent:.1f}"
                f" % ({far.low_percent:.1f} to {far.high_percent:.1f}) would be in time: what is"
                " missing then is missed between the beams, not beyond them."
            ),
            "",
        ]
    each = [
        (f"{d.from_deg:.0f}–{d.to_deg:.0f}", str(d.approaches), f"{d.percent:.1f}", _interval(d))
        for d in r.by_direction
    ]
    heads = ("from, °", "approaches", "in time, %", "interval")
    lines += ["## By direction", "", table(heads, each), f"Made by `{command}`, seed {r.seed}.", ""]
    return printable_lines("\n".join(lines))


def _interval(d: ShareModel) -> str:
    return f"{d.low_percent:.1f}–{d.high_percent:.1f}"


def _during(r: SafetyResult) -> str:
    if r.seconds_of_motion is None:
        return f", each at one of {r.moments} poses that is held, drawn by weight"
    return (
        f", while the robot moves; walks end at moments drawn evenly from {r.seconds_of_motion:.1f}"
        " s of motion, which comes round again"
    )


def _in_the_way(r: SafetyResult) -> str:
    blind = (
        " and blinds sensors of one zone in whose beams it stands" if r.occlusion == "blind" else ""
    )
    robot = f"The person walks on a floor at {r.floor_m:g} m in the base frame."
    robot += (
        f" The robot {'does not hide' if r.occlusion == 'ignore' else 'hides'} what is behind"
        f" it{blind}."
    )
    return f"{robot} So do {', '.join(r.obstacles)}, which stop nobody." if r.obstacles else robot


def _terms(r: SafetyResult) -> list[tuple[str, str, str, str]]:
    s = r.separation
    speed = (
        "the joints' speeds along the motion"
        if s.speeds_known
        else "given for all parts: no joint speeds are known"
    )
    return [
        ("v_h", f"{s.human_speed:g} m/s", "the person", "ISO 13855: walking"),
        ("v_r", f"0 to {s.fastest_m_s:.2f} m/s", "the part of the robot", speed),
        ("T_r", f"{s.reaction_s:g} s", "from what could be seen to the command to stop", "given"),
        (
            "T_s",
            f"{s.stopping_s:g} s at the fastest",
            "until the robot stands",
            "given, or UR10 CB3 manual 1.6.2 by speed",
        ),
        (
            "S_h",
            f"{s.S_h:.3f} m",
            "the person's way while the system reacts and stops",
            "v_h (T_r + T_s)",
        ),
        ("S_r", f"{s.S_r:.3f} m", "the robot's way until it brakes", "v_r T_r"),
        ("S_s", f"{s.S_s:.3f} m", "the robot's way while it brakes", "v_r T_s / 2"),
        ("C", f"{s.C:g} m", "what reaches in unseen", "given"),
        ("Z_d", f"{s.Z_d:g} m", "uncertainty of the person's place", "given"),
        ("Z_r", f"{s.Z_r:g} m", "uncertainty of the robot's place", "given"),
        ("**S**", f"**{s.largest_m:.3f} m**", "at the fastest part", "the sum"),
    ]


def _reach(r: SafetyResult) -> str:
    if r.range_m >= r.range_needed_m:
        return (
            f"The sensors see {r.range_m:.2f} m, which is at least the {r.range_needed_m:.2f} m"
            " asked at the fastest."
        )
    return (
        f"**The sensors see {r.range_m:.2f} m; {r.range_needed_m:.2f} m are asked where the robot"
        f" is fastest, and {r.range_m:.2f} m suffice at {r.range_suffices_percent:.0f} % of the"
        " moments.** Where they do not, sensors on the fastest part see a person only when it is"
        " too late, wherever they look: slow the robot down, shorten its stop, or take sensors"
        " that see farther."
    )


def _sensors(r: SafetyResult) -> list[str]:
    if not r.sensors:
        return [
            (
                "The sensor is not of the catalogue: its nominal range is taken as it is, for any"
                " target and light."
            ),
            "",
        ]
    lines = []
    for one in r.sensors:
        lines += [f"{one.title}, {one.range_m:.3f} m ({one.source}):", ""]
        rules = [
            (rule.rule, rule.found, f"{rule.range_m:.3f}", "figure" if rule.measured else "law")
            for rule in one.rules
        ]
        lines.append(table(("rule", "found", "m left", "basis"), rules))
    return lines
