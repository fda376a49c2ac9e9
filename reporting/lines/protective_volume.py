"""Lines about V_P: the formula with its terms, the source of the speed, and the disclaimer."""

from ...coverage.rings.ring import Setup
from ...formats.schema.result_models import VerifyResult
from ...formats.schema.sensor_records import title
from ...formats.schema.separation_models import SeparationModel

DISCLAIMER = "An engineering aid: it confers no safety rating."


def formula(s: SeparationModel) -> str:
    """Return the formula of S with each term as a number, at the fastest part."""
    return (
        f"S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d + Z_r = {s.S_h:.2f} + {s.S_r:.2f} +"
        f" {s.S_s:.2f} + {s.C:.2f} + {s.Z_d:.2f} + {s.Z_r:.2f} = {s.largest_m:.2f} m"
    )


def protective_lines(results: list[VerifyResult], setup: Setup) -> list[str]:
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
        f"At the fastest part {formula(s)} (ISO/TS 15066).",
        *reach,
        DISCLAIMER,
    ]
