"""Lines about what the calibration of an arm changes."""

from collections.abc import Sequence

from ...formats.schema.result_models import CalibrationEffectModel, VerifyResult
from ..tables import percent, target_label


def calibration_lines(
    results: Sequence[VerifyResult], effects: Sequence[CalibrationEffectModel]
) -> list[str]:
    """Return a line about an arm's calibration, if it has one.

    Args:
        results: coverage of each goal with the calibration.
        effects: what it changes, for each of them; empty without a calibration.
    """
    if not effects:
        return []
    each = "; ".join(
        f"{target_label(r)} {e.nominal_percent:.2f} → {percent(r, r.rule)} %"
        for r, e in zip(results, effects, strict=True)
    )
    return [
        f"Calibrated kinematics ({effects[0].source}): they move a sensor by up to"
        f" {effects[0].largest_move_mm:.2f} mm; coverage by the model → calibrated: {each}."
    ]
