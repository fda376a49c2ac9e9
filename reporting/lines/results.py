"""Lines about results: calibration, gap, worst pose, reach, ranges of sensors, and V_P."""

import math
from collections.abc import Sequence

from ...coverage.rings.ring import Setup
from ...coverage.rings.sensor_records import SensorRecord, title
from ...coverage.robots.joint_values import assignments
from ...objectives.object_bounds import ObjectBounds, SmallestObject
from ...objectives.reach import Beyond, beyond_sensors
from ...objectives.scene import Scene
from ...objectives.separation_summary import Separations
from ...objectives.verified import CalibrationEffect, Verified
from ...placement.bound.coverage_bound import CoverageBound
from ...placement.search.result import Reach
from ..tables import percent, target_label


def calibration_lines(
    results: Sequence[Verified], effects: Sequence[CalibrationEffect]
) -> list[str]:
    """Return a line about an arm's calibration, if it has one.

    Args:
        results: coverage of each goal with the calibration.
        effects: what it changes, for each of them; empty without a calibration.
    """
    if not effects:
        return []
    each = "; ".join(
        f"{target_label(r)} {100 * e.nominal:.2f} → {percent(r, r.rule)} %"
        for r, e in zip(results, effects, strict=True)
    )
    return [
        f"Calibrated kinematics ({effects[0].source}): they move a sensor by up to"
        f" {1000 * effects[0].largest_move:.2f} mm; coverage by the model → calibrated: {each}."
    ]


def gap_line(bound: CoverageBound | None) -> str | None:
    """Return how far the best layout may be; None if no bound was requested."""
    if bound is None:
        return None
    if bound.value is None or bound.gap is None:
        return "Optimality gap: interrupted before there was an upper bound."
    if not bound.informative:
        return (
            "Optimality gap: the upper bound says nothing here; it is 100 %. The sensors could"
            " cover all of the target if their beams never had to overlap."
        )
    return (
        f"Optimality gap: at most {100 * bound.gap:.2f} points. No layout within the same budget"
        f" and rules covers more than {100 * bound.value:.2f} %, wherever its rings sit"
        f" ({bound.seconds:.0f} s)."
    )


def fewest_sensors_line(bound: CoverageBound | None, reach: Reach | None) -> str | None:
    """Return how many sensors any layout needs; None without a bound or a coverage to reach."""
    if bound is None or bound.value is None or reach is None:
        return None
    wanted = f"{100 * reach.wanted:g} %"
    if (fewest := bound.fewest_sensors) is None:
        return f"The bound says nothing of the fewest sensors for {wanted}."
    enough = [one.sensors for one in reach.tried if one.reached]
    found = f"; the search found {min(enough)}" if enough else ""
    return f"No layout of fewer than {fewest} sensors reaches {wanted}{found}."


def worst_line(result: Verified) -> str | None:
    """Return a line about a setup's worst pose, or None if there is one pose only."""
    w = result.worst
    if w is None:
        return None
    when = "" if w.time_s is None else f" at {w.time_s:.2f} s"
    angles = assignments(w.q or {})
    if w.q_deg is not None:
        angles = f"[{', '.join(f'{a:.1f}' for a in w.q_deg)}]°"
    return (
        f"{target_label(result)}, {result.setup}: worst {percent(w, result.rule)} % in pose"
        f" {w.pose}{when}: {angles}"
    )


_NONE = 0.5  # percent of a target, below which nothing is said


def reach_lines(scene: Scene) -> list[str]:
    """Return a line for each target of which no layout covers a part.

    Raises:
        ValueError: as ``beyond_sensors`` does.
    """
    each = [(str(g.target), beyond_sensors(scene, g.target)) for g in scene.targets]
    return [line for name, b in each for line in _beyond(name, b)]


def record_lines(results: Sequence[Verified]) -> list[str]:
    """Return lines about the parts of targets that no layout covers and that people can touch."""
    lines = []
    for r in results:
        if r.beyond is not None:
            lines += _beyond(target_label(r), r.beyond)
        if r.people is not None:
            lines.append(
                f"{target_label(r)}: a person can touch {100 * r.people.share:.1f} % of it; of this"
                f" part {100 * r.people.zeta:.2f} % is covered."
            )
    return lines


def object_lines(results: Sequence[Verified]) -> list[str]:
    """Return lines about the largest unseen objects of the results, if they are known."""
    lines = []
    for r in results:
        if (o := r.smallest_object) is None:
            continue
        rod = f"vertical rod of {o.rod_length:g} m"
        lines += [
            f"{target_label(r)}, unseen: {bounds_text('sphere', o.sphere)};"
            f" {bounds_text(rod, o.rod)}. Point density: {o.zones_per_m3:.0f} zones per m³."
        ]
        if o.largest_gap is not None:
            lines.append(f"{target_label(r)}: {gap_verdict(o)}.")
    return lines


def bounds_text(shape: str, bounds: ObjectBounds) -> str:
    """Return the bounds of the largest unseen object in words, rounded outward to tenths of mm."""
    if bounds.centre is None and not bounds.open:
        return f"no {shape} of more than ⌀ {math.ceil(1e4 * bounds.high) / 10:.1f} mm"
    place = ", ".join(f"{x:.3f}" for x in bounds.centre or ())
    return f"the largest {shape} has ⌀ {bounds.text} (at {place} m, pose {bounds.pose})"


def gap_verdict(objects: SmallestObject) -> str:
    """Return whether the largest allowed gap is kept."""
    limit = f"no unseen sphere may have more than ⌀ {1000 * (objects.largest_gap or 0):g} mm"
    verdicts = {
        "pass": "kept, proved",
        "fail": f"violated, one has ⌀ {math.floor(1e4 * objects.sphere.low) / 10:.1f} mm",
        "not known": "not decided, the bounds contain it",
    }
    return f"{limit}: {verdicts[objects.verdict or 'not known']}"


def _beyond(name: str, beyond: Beyond) -> list[str]:
    share, error = 100 * beyond.share, 100 * beyond.error
    if share <= _NONE:
        return []
    return [
        f"{name}: {share:.1f} % (± {error:.1f}) of it is beyond any sensor that the rules allow on"
        f" the arm; no layout covers more than about {min(100 - share + error, 100):.1f} %."
    ]


def sensor_lines(records: Sequence[SensorRecord]) -> list[str]:
    """Return the derivation of each sensor's range, rule by rule."""
    lines = []
    for r in records:
        lines.append(f"{r.title}: {r.range_m:.3f} m used, beam of {r.fov_deg:.3g}°. Derivation:")
        for rule in r.rules:
            basis = "" if rule.measured else " (a law, not a measurement)"
            lines.append(f"  {rule.rule}: {rule.found}: {rule.range_m:.3f} m{basis}")
        best = [
            what
            for what, found in (
                ("light", r.ambient),
                ("reflectance", r.reflectance),
                ("size", r.target_size),
            )
            if found is None
        ]
        if best:
            lines.append(f"  not given, best case assumed: {', '.join(best)}")
        lines.append(f"  source: {r.source}{'; ' + r.note if r.note else ''}")
    return lines


DISCLAIMER = "An engineering aid: it confers no safety rating."


def formula(s: Separations) -> str:
    """Return the formula of S with each term as a number, at the fastest part."""
    return (
        f"S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d + Z_r = {s.S_h:.2f} + {s.S_r:.2f} +"
        f" {s.S_s:.2f} + {s.C:.2f} + {s.Z_d:.2f} + {s.Z_r:.2f} = {s.largest_m:.2f} m"
    )


def protective_lines(results: list[Verified], setup: Setup) -> list[str]:
    """Return lines about V_P among the results, and about the sensors whose range is too short for
    it.

    Returns:
        No lines if no result is of V_P.
    """
    s = next((r.separation for r in results if r.separation is not None), None)
    if s is None:
        return []
    known = (
        "from the joint speeds at each pose"
        if s.speeds_known
        else "some poses have no joint speeds; robot_speed is used there"
    )
    reach = [
        f"{title(sensor)} reaches {sensor.range_m:.2f} m, less than the {s.largest_m:.2f} m that"
        " the fastest part requires."
        for sensor in dict.fromkeys(group.sensor for group in setup.groups)
        if sensor.range_m < s.largest_m
    ]
    return [
        (
            f"V_P: separation distances of {s.least_m:.2f} to {s.largest_m:.2f} m, {s.mean_m:.2f}"
            f" m on average; the fastest part moves at {s.fastest_m_s:.2f} m/s ({known}), T_r"
            f" {s.reaction_s:g} s, T_s {s.stopping_s:g} s."
        ),
        f"At the fastest part {formula(s)} (form of ISO/TS 15066, now in ISO 10218-2:2025).",
        *reach,
        DISCLAIMER,
    ]
