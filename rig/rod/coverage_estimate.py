"""Estimate coverage from trials with the rod: which were seen, the share of the target, and whether
it agrees with the prediction.

The share is the weighted sum of the strata's shares. Its interval combines the strata's exact
intervals (Clopper and Pearson) by the variances recovered from their limits (MOVER; Zou and Donner
2008, Statistics in Medicine 27): the squared deviations of the weighted limits are added. Wilson's
intervals, a tenth narrower, would not do: where nearly all trials of heavy strata succeed, 97 % of
20 in each of three, the combined interval would contain the share 92 times in 100. A stratum
without trials has the interval from 0 to 1.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Int
from scipy import stats

from ...coverage.rings.ring import Setup
from ...simulation.twin.zone_grid import zoned
from ..sensing.readings import Readings, Stops, at_stops, zones_at_stops
from .trial_plan import RodPlan, Stratum

CONFIDENCE = 0.95
TOLERATED = 0.2  # of the places predicted seen or unseen; careful mounting moves the edge


@dataclass(frozen=True)
class Share:
    """A share in [0, 1] and its interval."""

    value: float
    """Estimate."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""


@dataclass(frozen=True)
class RodCheck:
    """Result of T trials with K sensors in a target."""

    plan: RodPlan
    """The planned trials."""
    told: Bool[np.ndarray, "T K"]
    """Which sensors, as wired, detected the rod."""
    tested: Bool[np.ndarray, " T"]
    """Which trials were completed."""
    share: Share
    """Measured share of the target."""

    @property
    def seen(self) -> Bool[np.ndarray, " T"]:
        """Which trials any sensor detected."""
        return _any(self.told)

    @property
    def predicted(self) -> float:
        """Predicted share of the target."""
        return self.plan.zeta

    @property
    def table(self) -> Int[np.ndarray, "2 2"]:
        """Number of trials by prediction (row: seen, not seen) and observation (column: seen, not
        seen).
        """
        cells: Any = [
            [self.plan.covered == p, self.seen == s] for p in (True, False) for s in (True, False)
        ]
        return np.array([(a & b & self.tested).sum() for a, b in cells]).reshape(2, 2)

    @property
    def agrees(self) -> bool:
        """Whether the interval contains the prediction."""
        return self.share.low <= self.predicted <= self.share.high

    def contradicted(self, covered: bool) -> bool:
        """Whether more than ``TOLERATED`` of the places predicted seen, or unseen, are otherwise,
        with the confidence of the interval.
        """
        row = self.table[0 if covered else 1]
        wrong, trials = int(row[1 if covered else 0]), int(row.sum())
        if not trials:
            return False
        return _interval(wrong, trials, 2 * CONFIDENCE - 1)[0] > TOLERATED

    @property
    def intruding(self) -> Int[np.ndarray, "2 K"]:
        """At how many places where no sensor should see the rod each sensor, as wired, did: at all
        of them, and at those that are not near the edge of coverage.
        """
        unseen = self.tested & ~self.plan.covered
        some = [unseen, unseen & ~self.plan.edge]
        return np.array([self.told[which].sum(axis=0) for which in some])


def check_rod(
    plan: RodPlan,
    setup: Setup,
    before: Readings,
    trials: Sequence[Readings | None],
) -> RodCheck:
    """Evaluate the trials.

    Args:
        plan: the planned trials.
        setup: the rings that were read.
        before: readings at every pose of the plan, without the rod.
        trials: readings with the rod at each point, in the plan's order; None, or no reading at the
            pose, means not tested.

    Raises:
        ValueError: if the number of trials differs from the plan, or a reading is of a sensor that
            the setup does not have.
    """
    if len(trials) != len(plan.trials):
        raise ValueError(f"{len(trials)} trials, but {len(plan.trials)} are planned")
    empty = at_stops(before, setup, plan.joints)
    zones = {i: zones_at_stops(before, setup, i, plan.joints) for i in zoned(setup)}
    told, tested = np.zeros((len(trials), setup.sensors), bool), np.zeros(len(trials), bool)
    for pose in range(len(plan.joints)):
        if not (empty.total[pose] > 0).any():
            continue
        for i in np.flatnonzero(plan.pose == pose):
            read = trials[int(i)]
            if read is not None and len(read):
                now = at_stops(read, setup, plan.joints[[pose]])
                tested[i] = (now.total > 0).any()
                told[i] = nearer(plan, empty, pose, now)
                for ring, was in zones.items():
                    mine = setup.ring_of_sensor == ring
                    zone = zones_at_stops(read, setup, ring, plan.joints[[pose]])
                    told[i, mine] |= nearer(plan, was, pose, zone).any(axis=1)
    return RodCheck(
        plan,
        told,
        tested,
        share(plan.strata, plan.stratum[tested], _any(told)[tested]),
    )


def _any(told: Bool[np.ndarray, "T K"]) -> Bool[np.ndarray, " T"]:
    return np.asarray(told.any(axis=1))


def nearer(plan: RodPlan, empty: Stops, pose: int, now: Stops) -> Bool[np.ndarray, "*K"]:
    """Return which sensors, or zones of sensors, read an object that was not there before."""
    was, read = empty.distance[pose], now.distance[0]
    with np.errstate(invalid="ignore"):
        closer = read < was - plan.detection.margin(was)
    return np.asarray(np.isfinite(read) & (closer | (np.isnan(was) & (empty.total[pose] > 0))))


def share(
    strata: Sequence[Stratum],
    stratum: Int[np.ndarray, " T"],
    seen: Bool[np.ndarray, " T"],
) -> Share:
    """Estimate the share of the target that is seen, from T trials, each of a stratum."""
    value, low, high, open_ = 0.0, 0.0, 0.0, 0.0
    for i, s in enumerate(strata):
        of_stratum = seen[stratum == i]
        if not len(of_stratum):
            open_ += s.weight
            continue
        least, most = _interval(int(of_stratum.sum()), len(of_stratum), CONFIDENCE)
        p = float(of_stratum.mean())
        value += s.weight * p
        low += (s.weight * (p - least)) ** 2
        high += (s.weight * (most - p)) ** 2
    return Share(
        value + open_ / 2,
        max(value - math.sqrt(low), 0.0),
        min(value + math.sqrt(high) + open_, 1.0),
    )


@cache
def _interval(seen: int, trials: int, confidence: float) -> tuple[float, float]:
    interval = stats.binomtest(seen, trials).proportion_ci(confidence, "exact")
    return float(interval.low), float(interval.high)
