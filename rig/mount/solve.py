"""Estimate the errors of a ring by least squares between expected and actual readings, with their
covariance.

Distances jump where a beam grazes an edge. So a robust loss first leads to the neighbourhood of the
solution. There, readings more than five standard deviations off and grazing readings are excluded,
and Gauss–Newton steps finish the fit. The selection is repeated at each step, and a step need not
lower the sum of squares: a search that insists on a decrease stops short of the solution, in front
of a reading that jumps on the way. The uncertainty follows from the derivatives and is scaled by
the residuals: noise above the model, or an inaccurate cell, widens it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ..sensing.expected import CELL, expected
from .mounting_error_model import LIMITS, free, grazing, moved, slopes

_WIDEST = 4.0  # times ``LIMITS``, bound on every error
_OUT = 5.0  # standard deviations
# times a stage's width: cap on the cost of a jump, so that a jump cannot block a step
_FARTHEST = 8.0
_WIDTHS = (10.0, 3.0, 3.0)  # standard deviations, beyond which the robust loss is linear, by stage
_STEPS = 20  # maximum Gauss–Newton steps
_SETTLED = 1e-3  # of ``LIMITS``, maximum change in the last step
# on the covariance: the linear theory knows neither that readings are selected at the solution nor
# how their derivatives change within the margins; without it 94 % of the 95 % regions held the
# truth (500 regions, measured with version 0.1.0)
_ALLOWANCE = 1.1


class MountError(ValueError):
    """The readings do not determine how a ring is mounted."""


@dataclass(frozen=True)
class Read:
    """Readings of a ring's n seats at P stops."""

    joints: Float[np.ndarray, "P J"]
    """Joint angles, rad."""
    distance: Float[np.ndarray, "P n"]
    """m; nan without a target."""
    sigma: Float[np.ndarray, "P n"]
    """Standard deviation of each reading, m."""


class Solved(NamedTuple):
    """Estimated errors of a ring."""

    values: Float[np.ndarray, " 4"]
    """Errors by ``NAMES``."""
    covariance: Float[np.ndarray, "p p"]
    """Covariance of the free errors."""
    used: int
    """Number of readings used."""
    scale: float
    """Scale of the residuals."""


def solve(scene: Scene, ring: Ring, read: Read, values: Float[np.ndarray, " 4"]) -> Solved:
    """Estimate the errors of ``ring``, starting at ``values`` (4,).

    Raises:
        MountError: if too few readings of the cell are usable.
    """
    index, values = free(scene, ring), values.copy()
    for width in _WIDTHS:
        which = _counting(scene, ring, read, values)[0]
        residuals, derivatives = _problem(scene, ring, read, which, values, _FARTHEST * width)
        start = np.clip(values[index] / LIMITS[index], -0.99 * _WIDEST, 0.99 * _WIDEST)
        rules: Any = {"bounds": (-_WIDEST, _WIDEST), "xtol": 1e-3, "ftol": 1e-3, "max_nfev": 30}
        optimum = least_squares(
            residuals, start, derivatives, loss="soft_l1", f_scale=width, **rules
        )
        values[index] = optimum.x * LIMITS[index]
    widest = _WIDEST * LIMITS[index]
    for _ in range(_STEPS):
        _, off, by = _counting(scene, ring, read, values, _OUT)
        step = -_inverse(by.T @ by) @ by.T @ off
        values[index] = np.clip(values[index] + step, -widest, widest)
        if (np.abs(step) <= _SETTLED * LIMITS[index]).all():
            break
    _, off, by = _counting(scene, ring, read, values, _OUT)
    scale = math.sqrt(float(off @ off) / (len(off) - len(index)))
    return Solved(values, _ALLOWANCE * scale**2 * _inverse(by.T @ by), len(off), scale)


def _counting(
    scene: Scene,
    ring: Ring,
    read: Read,
    values: Float[np.ndarray, " 4"],
    most: float = math.inf,
) -> tuple[Bool[np.ndarray, "P n"], Float[np.ndarray, " M"], Float[np.ndarray, "M p"]]:
    """Select the usable readings of a ring with errors ``values``: of the cell, within ``most``
    standard deviations, and not grazing. Return the selection, the residuals in standard
    deviations, and their derivatives by the free errors.
    """
    built, index = moved(scene, ring, values), free(scene, ring)
    seen = expected(scene, Setup((built,)), read.joints)
    with np.errstate(invalid="ignore"):
        off = (seen.distance + values[3] - read.distance) / read.sigma
    which = np.isfinite(off) & (seen.what == CELL)
    if most < math.inf:
        which &= np.abs(off) <= most * max(_deviation(off[which]), 1e-9)
    by = slopes(scene, built, read.joints, which)[1]
    steep = grazing(by)
    which[which] = ~steep
    if which.sum() < 3 * len(index):
        raise MountError(
            f"{int(which.sum())} usable readings of the cell, at least {3 * len(index)} are needed"
        )
    return which, off[which], by[~steep][:, index] / read.sigma[which][:, None]


def _inverse(information: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """Return the inverse, with very large values along directions without information."""
    unit = LIMITS[-len(information) :]
    value, vector = np.linalg.eigh(information * unit[:, None] * unit)
    inverse: np.ndarray = (vector / np.maximum(value, 1e-9)) @ vector.T * unit[:, None] * unit
    return inverse


def _deviation(values: np.ndarray) -> float:
    """Estimate the standard deviation from the median."""
    return 1.4826 * float(np.median(np.abs(values))) if len(values) else 0.0


def _problem(
    scene: Scene,
    ring: Ring,
    read: Read,
    which: Bool[np.ndarray, "P n"],
    values: Float[np.ndarray, " 4"],
    most: float,
) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Return the residuals and their derivatives, in standard deviations, of the readings ``which``
    as functions of the free errors in ``LIMITS``; residuals end at ``most``.
    """
    wanted, sigma, index = read.distance[which], read.sigma[which], free(scene, ring)

    @lru_cache(1)  # the derivatives are asked for where the residuals were
    def at(x: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        errors = values.copy()
        errors[index] = np.array(x) * LIMITS[index]
        distance, by = slopes(scene, moved(scene, ring, errors), read.joints, which)
        off = (distance + errors[3] - wanted) / sigma
        counts = (np.abs(off) < most) & ~grazing(by)
        slope = np.where(counts[:, None], (by * LIMITS)[:, index] / sigma[:, None], 0.0)
        return np.clip(off, -most, most), slope

    return lambda x: at(tuple(x))[0], lambda x: at(tuple(x))[1]
