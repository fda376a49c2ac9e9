"""Where a scene's poses come from, and which is the worst, in lines."""

import math

from ...formats.schema.result_models import VerifyResult
from ...objectives.scene import Scene
from ..tables import percent, target_label


def record_line(scene: Scene) -> str | None:
    """What the poses stand for, in a line; None where they are from no record."""
    r = scene.recorded
    if r is None:
        return None
    weight = (
        "dwell time"
        if r.speed_weight == 0
        else f"dwell time and speed (speed_weight {r.speed_weight:g})"
    )
    return (
        f"{r.file}: {r.rows:,} rows over {r.seconds:.1f} s as {len(scene.poses)} poses weighted by"
        f" {weight}; every row lies within {math.degrees(r.within):.1f}° of its pose in every"
        " joint."
    )


def worst_line(result: VerifyResult) -> str | None:
    """The worst pose of a setup in a line; None where there is but one."""
    w = result.worst
    if w is None:
        return None
    when = "" if w.time_s is None else f" at {w.time_s:.2f} s"
    angles = ", ".join(f"{a:.1f}" for a in w.q_deg)
    return (
        f"{target_label(result)}, {result.setup}: worst {percent(w, result.rule)} % in pose"
        f" {w.pose}{when}: [{angles}]°"
    )
