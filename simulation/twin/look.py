"""How sensors of one kind look into the world: a fan of rays, and the targets of their zones."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.sensors.effective_range import model_of
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.sensor_beams import BeamShapes
from .world import TwinWorld
from .zone_fan import SEPARATION, fan_places, fan_rays, steps_of, zone_targets
from .zone_grid import GridTurn, stated_turn, zone_grid


@dataclass(frozen=True)
class Look:
    """Sensors of one kind, and the rays that measure each."""

    sensors: Int[np.ndarray, " S"]
    """Numbers of the sensors."""
    rays: Float[np.ndarray, "N 3"]
    """Unit rays in the frame of a sensor."""
    length: Float[np.ndarray, " N"]
    """Length of each ray in the beam, m."""
    grid: tuple[int, int]
    """Rows of zones, and zones in a row."""
    steps: int
    """Steps between the rays of a zone, along a side."""
    targets: int
    """Most targets of a zone."""
    separation: float
    """Distance between two targets of a zone, m."""
    turn: GridTurn
    """How the grid arrives in a frame."""

    @property
    def zones(self) -> int:
        """Number of zones of a sensor."""
        return self.grid[0] * self.grid[1]

    def distance(
        self, world: TwinWorld, of: Int[np.ndarray, " M"], masked: Bool[np.ndarray, " G"]
    ) -> Float[np.ndarray, "M N"]:
        """Return the distance along each ray of some sensors, m; infinite where it meets nothing
        in the beam.

        Args:
            world: the world.
            of: numbers of the sensors.
            masked: which of its geoms block rays, but are not reported.
        """
        direction = self.rays @ world.frame[of].transpose(0, 2, 1)
        far, apex = float(self.length.max()), world.apex[of]
        each = [world.cast(*ray, farthest=far) for ray in zip(apex, direction, strict=True)]
        distance = np.array([hits.distance for hits in each])
        seen = distance <= self.length
        if masked.any():
            geom = np.array([hits.geom for hits in each])
            seen &= ~(masked[geom] & (geom >= 0))
        return np.where(seen, distance, np.inf)

    def measured(self, distance: Float[np.ndarray, "M N"]) -> Float[np.ndarray, "M z t"]:
        """Return the distances of the targets of each zone, nearest first, from those of the rays,
        m; infinite without a target. The zones are in the order of a frame."""
        grid = zone_targets(distance, self.grid, self.steps, self.targets, self.separation)
        arrived: np.ndarray = np.moveaxis(self.turn.arrives(np.moveaxis(grid, -1, 1)), 1, -1)
        return np.reshape(arrived, (len(distance), self.zones, self.targets))


def looks(setup: Setup, finer: int = 1) -> list[Look]:
    """Return the looks of a setup's sensors.

    Args:
        setup: the sensors.
        finer: factor on the number of steps between rays.
    """
    kinds = dict[tuple[Sensor, GridTurn], list[int]]()
    for group, slots in zip(setup.groups, setup.slices, strict=True):
        of = range(slots.start, slots.stop)
        kinds.setdefault((group.sensor, stated_turn(group)), []).extend(of)
    return [_look(unit, turn, of, finer) for (unit, turn), of in kinds.items()]


def _look(unit: Sensor, turn: GridTurn, of: list[int], finer: int) -> Look:
    shape = BeamShapes.of([unit], [unit], lambda values, _: np.asarray(values, float))
    beam = shape.solids(np.zeros((1, 3)), np.eye(3)[2:], np.eye(3)[1:2])
    grid, model = zone_grid(unit), None if unit.use is None else model_of(unit.use)
    steps = steps_of(*grid) * finer
    rays, length = fan_rays(beam, fan_places(*grid, steps))
    targets = 1 if model is None else model.targets or 1
    separation = SEPARATION if model is None else model.separation_m or SEPARATION
    return Look(np.array(of), rays[0], length[0], grid, steps, targets, separation, turn)
