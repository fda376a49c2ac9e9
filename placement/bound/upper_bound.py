"""An upper bound on the coverage of every layout within a budget, wherever its rings sit.

Let w be the weight of each place (1 in the target, or its weight field there, and 0 outside), C_i
the beams of a layout, and lambda >= 0 any field of prices. A place that some beam covers is worth
at most (w - lambda)^+ by itself, plus lambda for each beam that covers it. Summed over the target,

    covered weight  <=  integral of (w - lambda)^+  +  sum over i of  integral of lambda over C_i.

This is weak duality for the problem of maximum coverage (Nemhauser, Wolsey and Fisher 1978; Fisher
1981 on Lagrangian relaxation), and it holds for every field of prices. The last sum is a sum over
rings. Its largest value within the budget follows from the most that a ring of each size on each
link can collect, over all its positions, tilts and phases, and a knapsack over the sizes.

A place that k sensors must cover counts only if its number of sensors n is at least k. As
1[n >= k] <= min(1, n / k), each sensor collects lambda / k there, and the sum above is at most

    integral of (w - lambda)^+  +  (1 / k) sum over i of  integral of lambda over C_i.

This is the best that prices per place can give: min(1, n / k) is the least concave function of n
above 1[n >= k]. Its value at n < k is what it gives away: places that fewer than k sensors cover.

Two fields are used. With lambda = w each sensor collects at most the volume of its beam: the
*volume bound*, the number of sensors times the volume of a beam over that of the target. The other
field has low prices where layouts cover places several times, and a higher price elsewhere
(``multipliers``). It is lambda = w mu with a smooth field mu in [0, 1] (``price_field``), so beams
collect nothing beyond the target's surface. What rings collect is summed over cells at nodes, and
bounded between them (``link_cylinder``, ``ring_values``).

Weak duality holds exactly. The target's volume and the share of each voxel in it have proven bounds
(``voxel_shares``), whose safe ends are taken: so the faces of obstacles, of attached solids and of
volumes of one's own may lie along the voxels, and weights may step within them. Three sums are
numerical: that of 1 - mu over the voxels, those over cells in beams, and the excess between nodes
where beams cross the target's surface. The first has ``MARGIN`` added for its error, the others
their own margins; all are estimates on the safe side.

What rings of each size collect does not depend on the number of sensors. So one field of prices
bounds the coverage of every number of sensors, and the smallest number whose bound reaches a
coverage is the fewest that any layout could need for it (``CoverageBound.fewest_sensors``).

The bound is not the best layout. It counts rings as if their beams could be arranged, in fractions,
without covering a place twice. Where beams must overlap, as near the robot, it stays above every
layout. Sensors of one ring that overlap count twice, too. Spacing, envelopes of rings, and
occlusion by the robot, by what it carries and by obstacles are dropped; they only lessen coverage.
Fixed rings and single sensors are counted as they stand.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ..space.design import Space
from .coverage_bound import NOTHING, CoverageBound, TermBound
from .pose_bounds import AtPose, Effort

_LISTED = 64
_SHARPER = 2  # times that prices are sought for the fewest sensors


@dataclass(frozen=True)
class BoundsBySensors:
    """Upper bounds for each pair of G targets and P poses, by the number of sensors.

    The last axis is the number of sensors besides those that stay, from 0; for a given layout it
    has one entry.
    """

    scene: Scene
    by_volume: Float[np.ndarray, "G P N"]
    """Bounds by the volume of the beams alone."""
    by_prices: Float[np.ndarray, "G P N"]
    """Bounds by prices; 1 where none beat the volume."""

    @property
    def weights(self) -> Float[np.ndarray, "G P"]:
        """Weight of each pair in the mean."""
        return np.asarray(np.outer(self.scene.goal_weights, self.scene.pose_weights))

    @property
    def total(self) -> Float[np.ndarray, " N"]:
        """Bounds of the criterion over all targets and poses."""
        each = np.minimum(self.by_volume, self.by_prices)
        value = np.einsum("gp,gpn->n", self.weights, each)
        if self.scene.over_poses == "worst":
            value = np.minimum(value, np.einsum("g,gpn->pn", self.scene.goal_weights, each).min(0))
        capped: np.ndarray = np.minimum(value, 1.0)
        return capped

    def lowest(self, other: "BoundsBySensors") -> "BoundsBySensors":
        """Return the lower of the bounds of two sets of prices."""
        return replace(self, by_prices=np.minimum(self.by_prices, other.by_prices))

    def terms(self) -> tuple[TermBound, ...]:
        """Return the bounds of all sensors for at most 64 pairs."""
        pairs = list(np.ndindex(*self.weights.shape))[:_LISTED]
        labels = [str(goal.target) for goal in self.scene.targets]
        each = [(g, p, self.by_volume[g, p, -1], self.by_prices[g, p, -1]) for g, p in pairs]
        return tuple(TermBound(labels[g], p, float(min(v, c)), v, c) for g, p, v, c in each)


def upper_bound(
    scene: Scene,
    space: Space,
    aim: Criterion | None = None,
    effort: Effort | None = None,
    tell: Callable[[int, int], None] = lambda done, total: None,
    reach: float | None = None,
) -> CoverageBound | None:
    """Return a bound that no setup of a design space exceeds; None if none is known.

    For coverage after the worst loss the bound is that before the loss, which is never lower.
    ``unboundable`` states where no bound is known.

    Args:
        scene: robot, poses, targets, rules.
        space: the setups, with their number of sensors and rings.
        aim: criterion of the search; by default ζ itself.
        effort: work to spend.
        tell: called with the number of bounded pairs of target and pose, and of all.
        reach: coverage in [0, 1] for which the fewest sensors are bounded as well, for a space with
            a number of sensors.

    Raises:
        ValueError: for an empty target.
    """
    aim, effort, began = aim or Criterion(), effort or Effort(), time.monotonic()
    if unboundable(aim) is not None:
        return None
    bounds, fewest = _bounds(scene, space, aim, effort, tell), None
    if reach is not None:
        held, fewest = space.sensors - space.free, _fewest(space, bounds, reach)
        for _ in range(_SHARPER):
            if (before := fewest) >= space.sensors or not (bounds.by_prices < 1).any():
                break  # for fewer sensors the volume bound is even harder to beat
            # prices for a number may show that it is too small
            bounds = bounds.lowest(_bounds(scene, space, aim, effort, tell, before - held))
            if (fewest := _fewest(space, bounds, reach)) == before:
                break
        fewest = fewest if fewest > space.totals[0] else None
    value, seconds = float(bounds.total[-1]), time.monotonic() - began
    return CoverageBound(value, None, value < NOTHING, fewest, bounds.terms(), seconds)


def _bounds(
    scene: Scene,
    space: Space,
    aim: Criterion,
    effort: Effort,
    tell: Callable[[int, int], None],
    sharp: int | None = None,
) -> BoundsBySensors:
    """Return the bounds of a space; ``sharp``: number of new sensors for which prices are sought,
    by default all."""
    weights = np.outer(scene.goal_weights, scene.pose_weights)
    order = np.argsort(-weights, axis=None, kind="stable")
    priced = np.zeros(weights.size, bool)
    priced[order[: effort.terms]] = True
    goals, poses = weights.shape
    each = list[Float[np.ndarray, "2 N"]]()
    for p in range(poses):
        pose = AtPose(scene, space, p, aim.seen, sharp)
        for g in range(goals):
            tell(len(each), weights.size)
            each.append(np.stack(pose.bounds(g, effort, bool(priced[g * poses + p]))))
    by_volume, by_prices = np.stack(each, axis=1).reshape(2, poses, goals, -1).swapaxes(1, 2)
    return BoundsBySensors(scene, by_volume, by_prices)


def _fewest(space: Space, bounds: BoundsBySensors, reach: float) -> int:
    """Return the fewest sensors, those that stay included, whose bound reaches a coverage; above
    the sensors of the space the next number that the rules allow."""
    held, total = space.sensors - space.free, bounds.total
    enough = [n for n in space.totals if n > space.sensors or total[n - held] >= reach]
    return enough[0] if enough else space.sensors + 1


def unboundable(aim: Criterion) -> str | None:
    """Return what in a search rules out a bound, as text; None if there is one.

    Under mounting errors rings leave their places.
    """
    return None if aim.errors is None else "mounting errors"
