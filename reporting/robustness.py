"""Robustness of a setup as table rows and text: lost sensors and rings, and mounting errors."""

from collections.abc import Sequence

from ..coverage.definitions.units import degrees
from ..objectives.redundancy import Loss
from ..objectives.robustness import Robustness
from .explained import Explained
from .tables import target_label, target_legend


def robustness_rows(results: Sequence[Robustness]) -> list[list[str]]:
    """Return rows with a label and one cell in percent for each target."""
    e = results[0].errors
    mountings = (
        f"{e.draws} mountings, ±{1000 * e.position:g} mm,"
        f" ±{degrees(e.direction):g}°{' (2 σ)' if e.law == 'normal' else ''}"
    )
    several = range(2, len(results[0].seen) + 1)
    rows = {
        "ζ": [r.zeta for r in results],
        **{f"covered by at least {k} sensors": [r.seen[k - 1] for r in results] for k in several},
        "ζ without the worst sensor": [r.worst_sensor.zeta for r in results],
        "ζ without the worst ring": [r.worst_ring.zeta for r in results],
        f"mean ζ of {mountings}": [r.mean for r in results],
        "5th percentile of these mountings": [r.fifth_percentile for r in results],
    }
    return [[what, *(f"{100 * v:.2f}" for v in values)] for what, values in rows.items()]


def robustness_table(results: Sequence[Robustness]) -> Explained:
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


def lines(r: Robustness) -> str:
    """Return a line on the most important sensor and ring, and on the Monte Carlo error."""

    def lost(loss: Loss) -> str:
        if loss.single:
            return loss.single
        ring = f"ring {loss.ring} on {loss.link}"
        return ring if loss.sensor is None else f"sensor {loss.sensor} of {ring}"

    error = "" if r.mean_error is None else f" ± {100 * r.mean_error:.2f} (standard error)"
    return (
        f"largest losses: {lost(r.worst_sensor)} and {lost(r.worst_ring)}; mean under mounting"
        f" errors {100 * r.mean:.2f}{error}, minimum {100 * r.worst:.2f}; {r.seconds:.1f} s"
    )
