"""Lines about the source of a scene's poses and about the worst pose."""

import math

from ...coverage.robots.joint_values import assignments, radians_of
from ...formats.schema.result_models import VerifyResult
from ...objectives.scene import CoreScene
from ..tables import percent, target_label


def record_line(scene: CoreScene) -> str | None:
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


def worst_line(result: VerifyResult) -> str | None:
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
