"""Robustness of a setup as table rows and text: lost sensors and rings, and mounting errors."""

from ..formats.schema.robustness_models import LossModel, RobustnessResult
from .explained import Explained
from .tables import target_label, target_legend


def robustness_rows(results: list[RobustnessResult]) -> list[list[str]]:
    """Return rows with a label and one cell in percent for each target."""
    e = results[0].errors
    mountings = (
        f"{e.draws} mountings, ±{e.position_mm:g} mm,"
        f" ±{e.direction_deg:g}°{' (2 σ)' if e.law == 'normal' else ''}"
    )
    seen = {
        f"covered by at least {k} sensors": k for k in range(2, len(results[0].seen_percent) + 1)
    }
    rows = {
        "ζ": [r.zeta_percent for r in results],
        **{what: [r.seen_percent[k - 1] for r in results] for what, k in seen.items()},
        "ζ without the worst sensor": [r.worst_sensor.zeta_percent for r in results],
        "ζ without the worst ring": [r.worst_ring.zeta_percent for r in results],
        f"mean ζ of {mountings}": [r.mean_percent for r in results],
        "5th percentile of these mountings": [r.fifth_percentile_percent for r in results],
    }
    return [[what, *(f"{v:.2f}" for v in values)] for what, values in rows.items()]


def robustness_table(results: list[RobustnessResult]) -> Explained:
    """Return the same rows as a table for the terminal."""
    first = results[0]
    title = f"{first.setup}: coverage ζ in percent (rule sampled, voxels of {first.voxel:g} m)"
    return Explained.of(
        title,
        ("", *map(target_label, results)),
        robustness_rows(results),
        "worst: the sensor or ring whose loss costs most; mountings: random errors of position and"
        f" direction. {target_legend(results)}",
        left=("",),
    )


def lines(r: RobustnessResult) -> str:
    """Return a line on the most important sensor and ring, and on the Monte Carlo error."""

    def lost(loss: LossModel) -> str:
        if loss.single:
            return loss.single
        ring = f"ring {loss.ring} on {loss.link}"
        return ring if loss.sensor is None else f"sensor {loss.sensor} of {ring}"

    error = (
        "" if r.mean_error_percent is None else f" ± {r.mean_error_percent:.2f} (standard error)"
    )
    return (
        f"largest losses: {lost(r.worst_sensor)} and {lost(r.worst_ring)}; mean under mounting"
        f" errors {r.mean_percent:.2f}{error}, minimum {r.worst_percent:.2f}; {r.seconds:.1f} s"
    )
