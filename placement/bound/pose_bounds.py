"""Upper bounds on the coverage of a target at a pose, by the number of sensors."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_axes
from ...coverage.robots.kinematics import forward
from ...coverage.sensors.sensor import Sensor
from ...objectives.scene import Scene
from ..space.design import Space
from .blurred_beam import BlurredBeam, Profile
from .families import Budget, Family, families
from .multipliers import FoundPrices, find_prices
from .price_field import WIDTH, PriceField, TargetGrid
from .ring_values import STEP, RingMaxima, shares

MARGIN = 5e-4
"""Added to each bound for the sums over voxels, as a share of the target."""
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


class AtPose:
    """The rings and the sensors that stay, at one pose of a scene."""

    def __init__(
        self, scene: Scene, space: Space, pose: int, seen: int = 1, sharp: int | None = None
    ) -> None:
        """Read the families of a design space.

        Args:
            scene: the scene.
            space: the setups.
            pose: number of the pose.
            seen: number of sensors that must cover a point.
            sharp: number of new sensors for which prices are sought; None: all.
        """
        self.scene, self.pose, self.seen = scene, pose, seen
        self.families: tuple[Family, ...] = families(space, pose)
        self.budget = Budget.of(space, self.families)
        self.sharp = self.budget if sharp is None else replace(self.budget, sensors=sharp)
        held = Setup(space.fixed, scene.standing)
        frames = forward(scene.robot.chain, scene.poses[pose].q)
        self.apex, self.look = sensor_axes(scene.robot, held, frames)
        self.held: list[Sensor] = [
            *(ring.sensor for ring in held.rings for _ in range(ring.count)),
            *(one.sensor for one in held.singles),
        ]

    def bounds(
        self, goal: int, effort: Effort, priced: bool = True
    ) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
        """Return the bounds of a target by volume and by prices for each number of sensors; unless
        ``priced`` by volume only."""
        target = self.scene.targets[goal].target
        grid = TargetGrid.of(self.scene, target, self.pose, effort.voxels)
        volume = np.minimum(self._by_volume(grid) + MARGIN, 1.0)
        by_prices = np.ones(len(volume))
        if priced and effort.steps and self._resolved(grid, effort):
            field = Priced(self, grid, effort)
            if field.prices.bound <= self._at(volume) - _GAIN:
                by_prices = np.minimum(field.bounds(effort) + MARGIN, 1.0)
        return volume, by_prices

    def covered(self, goal: int, effort: Effort, enough: float) -> float:
        """Return what layouts in fractions cover of a target, or at least ``enough``; 1 where no
        prices are resolved."""
        grid = TargetGrid.of(self.scene, self.scene.targets[goal].target, self.pose, effort.voxels)
        if not self._resolved(grid, effort):
            return 1.0
        return Priced(self, grid, effort, enough=enough).prices.covered

    def _at(self, bounds: Float[np.ndarray, " N"]) -> float:
        """Return the bound for which prices are sought."""
        return float(bounds[-1] if self.sharp.layout is not None else bounds[self.sharp.sensors])

    def _resolved(self, grid: TargetGrid, effort: Effort) -> bool:
        """Return whether the sums along each beam resolve the prices: not for a beam that is
        hundreds of times as long as their Gaussians are wide."""
        sigma = WIDTH * grid.spacing(effort.points)
        sensors = {f.sensor for f in self.families} | set(self.held)
        return all(Profile.of(sensor, sigma).resolves(sigma) for sensor in sensors)

    def _by_volume(self, grid: TargetGrid) -> Float[np.ndarray, " N"]:
        values = [
            np.array(f.counts) * Profile.of(f.sensor).volume / grid.volume for f in self.families
        ]
        held = math.fsum(Profile.of(sensor).volume for sensor in self.held) / grid.volume
        return (self.budget.by_sensors(values) + held) / self.seen


class Priced:
    """A field of prices for a target at a pose."""

    def __init__(
        self,
        pose: AtPose,
        grid: TargetGrid,
        effort: Effort,
        prices: Float[np.ndarray, " J"] | None = None,
        enough: float = math.inf,
    ) -> None:
        """Find prices until ``enough``, as ``find_prices`` does, or take the given ones."""
        self.pose, self.field = pose, PriceField(grid, effort.points)
        sensors = {f.sensor for f in pose.families} | set(pose.held)
        beams = {sensor: BlurredBeam(sensor, self.field.sigma) for sensor in sensors}
        self.beams = [beams[f.sensor] for f in pose.families]
        self.standing = np.zeros(len(self.field.held))
        for sensor, apex, look in zip(pose.held, pose.apex, pose.look, strict=True):
            mass = shares(beams[sensor], self.field, apex[None], look[None])[0]
            self.standing += np.minimum(mass * self.field.worth, self.field.held)
        self.prices = (
            FoundPrices(prices, 0.0, 0.0)
            if prices is not None
            else find_prices(
                pose.families,
                self.beams,
                self.field,
                pose.sharp,
                self.standing,
                pose.seen,
                effort.steps,
                enough,
            )
        )

    def bounds(self, effort: Effort) -> Float[np.ndarray, " N"]:
        """Return the bounds that the prices give, refined within the effort."""
        pose, fixed = self.pose, self.field.uncollected(self.prices.values)
        fixed += float(self.standing @ self.prices.values) / pose.seen
        maxima = [
            RingMaxima(f, b, self.field, self.prices.values, effort.step)
            for f, b in zip(pose.families, self.beams, strict=True)
        ]
        while True:
            _, rings = pose.sharp.best([m.bound for m in maxima])
            before = [m.nodes for m in maxima]
            for f, one in enumerate(maxima):
                chosen = np.array(sorted({i for g, i in rings if g == f}), int)
                if len(chosen) and one.nodes < effort.tilts:
                    one.refine(chosen, min(effort.tilts - one.nodes, 8))
            if [m.nodes for m in maxima] == before:
                break
        values = pose.budget.by_sensors([m.bound for m in maxima])
        return fixed + values / pose.seen
