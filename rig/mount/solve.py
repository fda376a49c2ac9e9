"""The errors of a ring that bring what is expected nearest to what was read, by least squares, and
their covariance.

Distances jump where a beam grazes an edge, so that a robust loss leads to the neighbourhood of the
answer; there what is off by more than five deviations is left out, as is what grazes, and steps of
plain least squares (Gauss and Newton's) have the last word. What counts is asked anew at each of
them, and none must lower the sum of squares: a search that insists on that stops short of the
answer, before a reading that jumps on the way. Uncertainty follows from the slopes and is scaled by
the residuals themselves: noise larger than thought, or a cell that is not quite as told, widens it.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ..sensing.expected import CELL, expected
from .model import LIMITS, free, grazing, moved, slopes

_WIDEST = 4.0  # times ``LIMITS``: no error is sought beyond
_OUT = 5.0  # deviations
# times a stage's width: what a jump may cost at most, so that no step is barred by one
_FARTHEST = 8.0
_WIDTHS = (10.0, 3.0, 3.0)  # deviations, beyond which the robust loss is linear, stage by stage
_STEPS = 20  # of plain least squares, at most
_SETTLED = 1e-3  # of ``LIMITS``, by which the last of them moves, at most


class MountError(ValueError):
    """Readings that say nothing of how a ring is mounted."""


@dataclass(frozen=True)
class Read:
    """What a ring's n seats read at P stops, m, nan where nothing, and the deviation of each."""

    joints: Float[np.ndarray, "P J"]
    distance: Float[np.ndarray, "P n"]
    sigma: Float[np.ndarray, "P n"]


class Solved(NamedTuple):
    """Errors (4,) by ``NAMES``, covariance of those that are free, readings used, and the scale of
    their residuals.
    """

    values: Float[np.ndarray, " 4"]
    covariance: Float[np.ndarray, "p p"]
    used: int
    scale: float


def solve(scene: Scene, ring: Ring, read: Read, values: Float[np.ndarray, " 4"]) -> Solved:
    """The errors of ``ring``, sought from ``values`` (4,) on.

    Raises:
        MountError: if too few readings of the cell count.
    """
    some, values = free(scene, ring), values.copy()
    for width in _WIDTHS:
        which = _counting(scene, ring, read, values)[0]
        problem = _Problem(scene, ring, read, which, some, values, _FARTHEST * width)
        start = np.clip(values[some] / LIMITS[some], -0.99 * _WIDEST, 0.99 * _WIDEST)
        rules: Any = {"bounds": (-_WIDEST, _WIDEST), "xtol": 1e-3, "ftol": 1e-3, "max_nfev": 30}
        found = least_squares(
            problem.residuals, start, problem.slopes, loss="soft_l1", f_scale=width, **rules
        )
        values[some] = found.x * LIMITS[some]
    for _ in range(_STEPS):
        _, off, by = _counting(scene, ring, read, values, _OUT)
        step = -_inverse(by.T @ by) @ by.T @ off
        values[some] = np.clip(values[some] + step, -_WIDEST * LIMITS[some], _WIDEST * LIMITS[some])
        if (np.abs(step) <= _SETTLED * LIMITS[some]).all():
            break
    _, off, by = _counting(scene, ring, read, values, _OUT)
    scale = math.sqrt(float(off @ off) / (len(off) - len(some)))
    return Solved(values, scale**2 * _inverse(by.T @ by), len(off), scale)


def _counting(
    scene: Scene, ring: Ring, read: Read, values: Float[np.ndarray, " 4"], most: float = math.inf
) -> tuple[Bool[np.ndarray, "P n"], Float[np.ndarray, " M"], Float[np.ndarray, "M p"]]:
    """Which readings count for a ring with errors ``values``: of the cell, within ``most``
    deviations as they are, and not grazing; how far what is expected lies beyond each, in
    deviations, and the slopes of that by the errors that are free."""
    built, some = moved(scene, ring, values), free(scene, ring)
    seen = expected(scene, Setup((built,)), read.joints)
    with np.errstate(invalid="ignore"):
        off = (seen.distance + values[3] - read.distance) / read.sigma
    which = np.isfinite(off) & (seen.what == CELL)
    if most < math.inf:
        which &= np.abs(off) <= most * max(_deviation(off[which]), 1e-9)
    by = slopes(scene, built, read.joints, which)[1]
    steep = grazing(by)
    which[which] = ~steep
    if which.sum() < 3 * len(some):
        raise MountError(
            f"found {int(which.sum())} readings of the cell, allowed: {3 * len(some)} and more"
        )
    return which, off[which], by[~steep][:, some] / read.sigma[which][:, None]


def _inverse(information: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """The inverse, very large along what nothing is known of."""
    unit = LIMITS[-len(information) :]
    value, vector = np.linalg.eigh(information * unit[:, None] * unit)
    inverse: np.ndarray = (vector / np.maximum(value, 1e-9)) @ vector.T * unit[:, None] * unit
    return inverse


def _deviation(values: np.ndarray) -> float:
    """Standard deviation, by the median."""
    return 1.4826 * float(np.median(np.abs(values))) if len(values) else 0.0


class _Problem:
    """Residuals and slopes, in deviations, of the readings ``which`` by errors in ``LIMITS``; the
    last answer is kept.
    """

    def __init__(
        self,
        scene: Scene,
        ring: Ring,
        read: Read,
        which: np.ndarray,
        some: np.ndarray,
        values: np.ndarray,
        most: float,
    ):
        self.scene, self.ring, self.read, self.which, self.some = scene, ring, read, which, some
        self.fixed, self.most = values.copy(), most
        self.wanted, self.sigma = read.distance[which], read.sigma[which]
        self._at: np.ndarray | None = None

    def _look(self, x: np.ndarray) -> None:
        if self._at is None or not np.array_equal(x, self._at):
            self.fixed[self.some] = x * LIMITS[self.some]
            found, by = slopes(
                self.scene, moved(self.scene, self.ring, self.fixed), self.read.joints, self.which
            )
            off = (found + self.fixed[3] - self.wanted) / self.sigma
            self._residuals: np.ndarray = np.clip(off, -self.most, self.most)
            told = (np.abs(off) < self.most) & ~grazing(by)
            self._slopes = np.where(
                told[:, None], (by * LIMITS)[:, self.some] / self.sigma[:, None], 0.0
            )
            self._at = x.copy()

    def residuals(self, x: np.ndarray) -> np.ndarray:
        self._look(x)
        return self._residuals

    def slopes(self, x: np.ndarray) -> np.ndarray:
        self._look(x)
        return self._slopes
