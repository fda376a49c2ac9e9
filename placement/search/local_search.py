"""Local search: nlopt moves all rings of a setup at once along JAX's gradient of the soft coverage,
with the rules as its constraints.
"""

import math
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import nlopt
import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from ...coverage.rings.ring_kinematics import RingArrays
from ...objectives.link_segments import ABOVE, BELOW, HIGH, LOW
from ...objectives.parameterization import Interval, at_tilt, tilt_slope
from ...objectives.soft_coverage import SoftCoverage
from ...objectives.soft_terms import Sample
from ..stop_token import StopToken

Values = Float[np.ndarray, "3 R"]
_TOLERANCE = 1e-7  # of constraints, as a share of a link
_ACTIVE = 1e-4  # share of a link, and rad: nearer to its bound a rule is active
_ENOUGH = 1e-6  # gain of a step at which a climb ends


@dataclass(frozen=True)
class ClimbEffort:
    """Effort of a local search."""

    widths: tuple[float, ...] = (0.005, 0.002)
    """Widths of the sigmoid, m, one climb after the other."""
    steps: int = 15
    """Most evaluations of each climb."""
    far: float = 0.01
    """How far values may move from the start, as a share of a link and in rad."""


@dataclass(frozen=True)
class Climb:
    """Result of a local search."""

    values: Values
    """Positions, tilts and phases of the rings."""
    start: float
    """Soft coverage at the start."""
    soft: float
    """Soft coverage at the end."""
    slope: float
    """Norm of the gradient at the end, less what the rules forbid to follow, in shares of the
    target by mm along the links and by degrees."""
    evaluations: int
    """Number of evaluations."""


@dataclass(frozen=True)
class RingConstraints:
    """The free directions of the values of rings, and what the rules demand of these values."""

    where: Interval
    """Segments of the rings."""
    start: Values
    """Values from which steps are counted."""
    basis: Float[np.ndarray, "V 3 R"]
    """Change of the values by a step in each direction."""
    low: Float[np.ndarray, " V"]
    """Least step in each direction."""
    high: Float[np.ndarray, " V"]
    """Greatest step in each direction."""

    @staticmethod
    def of(where: Interval, low: Values, high: Values, start: Values) -> "RingConstraints":
        """Return the rules about ``start``, for the bounds of the values that ``decode`` reads."""
        basis, ends = list[np.ndarray](), list[tuple[float, float]]()

        def direction(row: int, rings: Any, by: Any, end: tuple[float, float]) -> None:
            basis.append(np.zeros_like(start))
            basis[-1][row, rings] = by
            ends.append(end)

        free = high > low
        for i in np.flatnonzero(free[0] & where.loose):
            direction(0, [i], 1.0, (-start[0, i], 1 - start[0, i]))
        for k in np.flatnonzero(free[1]):
            rings = np.flatnonzero(where.tilt_of == k)
            tilt = float((where.sign * start[1])[rings[0]]) if len(rings) else 0.0
            direction(1, rings, where.sign[rings], (low[1, k] - tilt, high[1, k] - tilt))
        for i in np.flatnonzero(free[2]):
            direction(2, [i], 1.0, (-math.pi, math.pi))
        each = np.array(ends).reshape(-1, 2)
        return RingConstraints(where, start, np.array(basis).reshape(-1, *start.shape), *each.T)

    def values(self, step: Float[np.ndarray, " V"]) -> Values:
        """Return the values after a step."""
        values: np.ndarray = self.start + np.tensordot(step, self.basis, 1)
        return values

    def along(self, slope: Float[np.ndarray, "*C 3 R"]) -> Float[np.ndarray, "*C V"]:
        """Return gradients by the steps from those by the values."""
        by: np.ndarray = np.tensordot(slope, self.basis, ((-2, -1), (1, 2)))
        return by

    def neighbours(self) -> list[tuple[int, int]]:
        """Return the pairs of neighbours on one segment, the lower one first."""
        segment = np.asarray(self.where.segment)
        order = np.lexsort((self.start[0], segment))
        pairs = zip(order[:-1].tolist(), order[1:].tolist(), strict=True)
        return [(i, j) for i, j in pairs if segment[i] == segment[j]]

    def excess(self, values: Values) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, "C 3 R"]]:
        """Return by how much values break each rule, above 0, and the gradients.

        A ring stays between the ends of its segment, which depend on its tilt, and from the next
        one as far as their envelopes and the rules demand.
        """
        position, tilt = values[:2]
        each, table = np.arange(len(tilt)), np.asarray(self.where.by_tilt)
        row, slope = at_tilt(table, each, tilt), tilt_slope(table, each, tilt)  # (R, 4)
        moving, pairs = np.flatnonzero(self.where.loose), self.neighbours()
        count = 2 * len(moving) + len(pairs)
        excess, by = np.zeros(count), np.zeros((count, 3, len(tilt)))
        for c, i in enumerate(moving.tolist()):
            excess[2 * c : 2 * c + 2] = row[i, LOW] - position[i], position[i] - row[i, HIGH]
            by[2 * c : 2 * c + 2, :2, i] = (-1.0, slope[i, LOW]), (1.0, -slope[i, HIGH])
        for c, (i, j) in enumerate(pairs, 2 * len(moving)):
            least, envelopes = self.where.least[j], row[i, ABOVE] + row[j, BELOW]
            excess[c] = max(envelopes, least) - (position[j] - position[i])
            by[c, 0, [i, j]] = 1.0, -1.0
            if envelopes > least:
                by[c, 1, [i, j]] = slope[i, ABOVE], slope[j, BELOW]
        return excess, by


def climb(
    soft: SoftCoverage,
    arrays: RingArrays,
    rules: RingConstraints,
    sample: Sample,
    brake: StopToken,
    effort: ClimbEffort | None = None,
) -> Climb:
    """Improve the values of a setup's rings.

    Args:
        soft: the soft coverage.
        arrays: the rings.
        rules: the start, and what the values must satisfy.
        sample: the points.
        brake: ends the climb.
        effort: widths and steps; by default those that end a search.

    Returns:
        The best values that satisfy the rules; those at the start if the climb is stopped at once.
    """
    effort = effort or ClimbEffort()
    spent, best, last = 0, rules.start, effort.widths[-1]

    def evaluate(values: Values, width: float) -> tuple[float, Values]:
        nonlocal spent
        spent += 1
        return soft.value_and_slope(arrays, values, width, sample)

    before, slope = after, by = evaluate(best, last)
    for width in effort.widths if len(rules.basis) else ():
        best = _climbed(partial(evaluate, width=width), rules, best, effort, brake)
        if brake.on():
            break
    if spent > 1:
        after, by = evaluate(best, last)
    if after < before:
        best, after, by = rules.start, before, slope
    return Climb(best, before, after, _stationarity(rules, arrays, best, by), spent)


def _climbed(
    evaluate: Callable[[Values], tuple[float, Values]],
    rules: RingConstraints,
    first: Values,
    effort: ClimbEffort,
    brake: StopToken,
) -> Values:
    """Run nlopt's sequential quadratic programming from the values ``first``; return the best."""
    best, top = first, -np.inf
    begin = rules.along(first - rules.start) / np.square(rules.basis).sum(axis=(1, 2))

    def value(step: np.ndarray, slope: np.ndarray) -> float:
        nonlocal best, top
        values = rules.values(step)
        soft, by = evaluate(values)
        if slope.size:
            slope[:] = rules.along(by)
        if soft > top and rules.excess(values)[0].max(initial=0.0) <= 2 * _TOLERANCE:
            best, top = values, soft
        if brake.on():
            stopped.force_stop()
        return soft

    def excess(result: np.ndarray, step: np.ndarray, slope: np.ndarray) -> None:
        result[:], by = rules.excess(rules.values(step))
        if slope.size:
            slope[:] = rules.along(by)

    optimizer = nlopt.opt(nlopt.LD_SLSQP, len(begin))
    # nlopt holds `value`, where the garbage collector cannot look: a cycle would never be freed
    stopped = weakref.proxy(optimizer)
    optimizer.set_exceptions_enabled(False)
    low = np.minimum(np.maximum(rules.low, -effort.far), 0.0)
    high = np.maximum(np.minimum(rules.high, effort.far), 0.0)
    optimizer.set_lower_bounds(low)
    optimizer.set_upper_bounds(high)
    optimizer.set_maxeval(effort.steps)
    optimizer.set_ftol_abs(_ENOUGH)
    optimizer.set_max_objective(value)
    if count := len(rules.excess(first)[0]):
        optimizer.add_inequality_mconstraint(excess, np.full(count, _TOLERANCE))
    optimizer.optimize(np.clip(begin, low, high))
    return best


def _stationarity(
    rules: RingConstraints, arrays: RingArrays, values: Values, slope: Values
) -> float:
    """Return the norm of the gradient less its part that the active rules forbid to follow, by mm
    and degrees."""
    unit = np.full_like(values, math.radians(1))
    unit[0] = 0.001 / np.where(arrays.length > 0, arrays.length, np.inf)[: values.shape[1]]
    excess, by = rules.excess(values)
    step = rules.along(values - rules.start) / np.square(rules.basis).sum(axis=(1, 2))
    bounds = np.eye(len(step))
    at_low, at_high = step - rules.low < _ACTIVE, rules.high - step < _ACTIVE
    outward = [rules.along(by[excess > -_ACTIVE] * unit), -bounds[at_low], bounds[at_high]]
    normals, gradient = np.concatenate(outward), rules.along(slope * unit)
    if not len(normals):
        return float(np.linalg.norm(gradient))
    return float(nnls(normals.T, gradient)[1])
