"""An upper bound on the coverage of every layout within a budget, wherever its rings sit.

Let w be the weight of the places of a target (1 in the target, or its weight field), C_i the beams
of a layout, and lambda >= 0 any field of prices. A place that some beam covers is worth at most
(w - lambda)^+ by itself, plus lambda for each beam that covers it. Summed over the target,

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
(``multipliers``). It is a smooth field (``price_field``) inside the target and 0 outside, so beams
collect nothing beyond the target's surface. What rings collect is summed over cells at nodes, and
bounded between them (``link_cylinder``, ``ring_values``).

Weak duality holds exactly. Three sums are numerical: those over the voxels of the target, those
over cells in beams, and the excess between nodes where beams cross the target's surface. The first
has ``MARGIN`` added for its error, the others their own margins; all are estimates on the safe
side. The first is no estimate for flat faces along the voxels, or for weight fields sampled at
their centres: for such targets no bound is stated (``unboundable``).

The bound is not the best layout. It counts rings as if their beams could be arranged, in fractions,
without covering a place twice. Where beams must overlap, as near the robot, it stays above every
layout. Sensors of one ring that overlap count twice, too. Spacing, occlusion and envelopes of rings
are dropped; they only lessen coverage. Fixed rings and single sensors are counted as they stand.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_axes
from ...coverage.robots.kinematics import forward
from ...coverage.sensors.sensor import Sensor
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ..space.design import Space
from .blurred_beam import BlurredBeam, Profile
from .coverage_bound import NOTHING, CoverageBound, TermBound
from .families import Budget, Family, families
from .multipliers import find_prices
from .price_field import WIDTH, PriceField, TargetGrid
from .ring_values import STEP, RingMaxima, shares

MARGIN = 5e-4
"""Added to each bound for the sums over voxels, as a share of the target."""
_LISTED = 64
_GAIN = 0.002  # below the volume bound: prices that promise less are not followed up


@dataclass(frozen=True)
class Effort:
    """How much work a bound takes."""

    points: int = 10_000
    """Gaussians of a field of prices."""
    steps: int = 120
    """Most steps towards good prices; 0: the volume bound only."""
    tilts: int = 160
    """About the most tilts of rings on a link at which a field is evaluated."""
    step: float = STEP
    """Side of the cells in which a field is integrated, in standard deviations of a Gaussian."""
    voxels: int = 2_000_000
    """Voxels of the box about a target on which its integrals are computed."""
    terms: int = 4
    """Most pairs of target and pose with prices; the others have the volume bound."""


def upper_bound(
    scene: Scene,
    space: Space,
    aim: Criterion | None = None,
    effort: Effort | None = None,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> CoverageBound | None:
    """Return a bound that no setup of a design space exceeds; None if none is known.

    For coverage after the worst loss the bound is that before the loss, which is never lower.
    ``unboundable`` lists where no bound is known.

    Args:
        scene: robot, poses, targets, rules.
        space: the setups, with their number of sensors and rings.
        aim: criterion of the search; by default ζ itself.
        effort: work to spend.
        tell: called with the number of bounded pairs of target and pose, and of all.

    Raises:
        ValueError: for an empty target.
    """
    aim, effort, began = aim or Criterion(), effort or Effort(), time.monotonic()
    if unboundable(scene, aim) is not None:
        return None
    weights = np.outer(scene.goal_weights, scene.pose_weights)
    order = np.argsort(-weights, axis=None, kind="stable")
    priced = set(order[: effort.terms].tolist())
    terms: list[TermBound] = []
    for i, (g, p) in enumerate(np.ndindex(*weights.shape)):
        tell(i, weights.size)
        if not terms or p != terms[-1].pose:
            pose = AtPose(scene, space, p, aim.seen)
        terms.append(pose.bound(g, effort, i in priced))
    each = np.array([t.value for t in terms]).reshape(weights.shape)
    value = float((weights * each).sum())
    if scene.over_poses == "worst":
        value = min(value, float((scene.goal_weights @ each).min()))
    value, seconds = min(value, 1.0), time.monotonic() - began
    return CoverageBound(value, None, value < NOTHING, tuple(terms[:_LISTED]), seconds)


def unboundable(scene: Scene, aim: Criterion) -> str | None:
    """Return what in a search rules out a bound, as text; None if there is one.

    Under mounting errors rings leave their places. Sums over voxels are good enough for named
    volumes without weights, in a scene without obstacles and attached solids, whose faces may be
    flat.
    """
    targets = [goal.target for goal in scene.targets]
    reasons = {
        "mounting errors": aim.errors is not None,
        "obstacles": bool(scene.obstacles),
        "attached solids": bool(scene.robot.attached),
        "a target volume of your own": not all(t.named for t in targets),
        "a weight field": any(t.importance is not None for t in targets),
    }
    return next((text for text, applies in reasons.items() if applies), None)


class AtPose:
    """The rings and the sensors that stay, at one pose of a scene."""

    def __init__(self, scene: Scene, space: Space, pose: int, seen: int = 1) -> None:
        """Read the families of a design space; ``seen`` sensors must cover a point."""
        self.scene, self.pose, self.seen = scene, pose, seen
        self.families: tuple[Family, ...] = families(space, pose)
        self.budget = Budget.of(space, self.families)
        held = Setup(space.fixed, scene.standing)
        frames = forward(scene.robot.chain, scene.poses[pose].q)
        self.apex, self.look = sensor_axes(scene.robot, held, frames)
        self.held: list[Sensor] = [
            *(ring.sensor for ring in held.rings for _ in range(ring.count)),
            *(one.sensor for one in held.singles),
        ]

    def bound(self, goal: int, effort: Effort, priced: bool = True) -> TermBound:
        """Return the bound for a target; unless ``priced`` by volume only."""
        target, by_prices = self.scene.targets[goal].target, 1.0
        grid = TargetGrid.of(self.scene, target, self.pose, effort.voxels)
        volume = min(self._by_volume(grid) + MARGIN, 1.0)
        if priced and effort.steps and self._resolved(grid, effort):
            field = Priced(self, grid, effort)
            if field.estimate <= volume - _GAIN:
                by_prices = min(field.bound(effort) + MARGIN, 1.0)
        return TermBound(str(target), self.pose, min(volume, by_prices), volume, by_prices)

    def _resolved(self, grid: TargetGrid, effort: Effort) -> bool:
        """Return whether the sums along each beam resolve the prices: not for a beam that is
        hundreds of times as long as their Gaussians are wide."""
        sigma = WIDTH * grid.spacing(effort.points)
        sensors = {f.sensor for f in self.families} | set(self.held)
        return all(Profile.of(sensor, sigma).resolves(sigma) for sensor in sensors)

    def _by_volume(self, grid: TargetGrid) -> float:
        values = [
            np.array(f.counts) * Profile.of(f.sensor).volume / grid.volume for f in self.families
        ]
        held = math.fsum(Profile.of(sensor).volume for sensor in self.held) / grid.volume
        return (self.budget.best(values)[0] + held) / self.seen


class Priced:
    """A field of prices for a target at a pose."""

    def __init__(
        self,
        pose: AtPose,
        grid: TargetGrid,
        effort: Effort,
        prices: Float[np.ndarray, " J"] | None = None,
    ) -> None:
        """Find prices, or take the given ones, at most 1."""
        self.pose, self.field = pose, PriceField(grid, effort.points)
        sensors = {f.sensor for f in pose.families} | set(pose.held)
        beams = {sensor: BlurredBeam(sensor, self.field.sigma) for sensor in sensors}
        self.beams = [beams[f.sensor] for f in pose.families]
        self.standing = np.zeros(len(self.field.held))
        for sensor, apex, look in zip(pose.held, pose.apex, pose.look, strict=True):
            mass = shares(beams[sensor], self.field, apex[None], look[None])[0]
            self.standing += mass * self.field.worth
        self.prices, self.estimate = (
            find_prices(
                pose.families,
                self.beams,
                self.field,
                pose.budget,
                self.standing,
                pose.seen,
                effort.steps,
            )
            if prices is None
            else (prices, 0.0)
        )

    def bound(self, effort: Effort) -> float:
        """Return the bound that the prices give, refined within the effort."""
        pose, fixed = self.pose, self.field.uncollected(self.prices)
        fixed += float(self.standing @ self.prices) / pose.seen
        maxima = [
            RingMaxima(f, b, self.field, self.prices, effort.step)
            for f, b in zip(pose.families, self.beams, strict=True)
        ]
        value, rings = pose.budget.best([m.bound for m in maxima])
        while True:
            before = [m.nodes for m in maxima]
            for f, one in enumerate(maxima):
                chosen = np.array(sorted({i for g, i in rings if g == f}), int)
                if len(chosen) and one.nodes < effort.tilts:
                    one.refine(chosen, min(effort.tilts - one.nodes, 8))
            if [m.nodes for m in maxima] == before:
                break
            value, rings = pose.budget.best([m.bound for m in maxima])
        return fixed + value / pose.seen
