"""The grid of a sensor's zones, and the ways in which it can be turned.

Zones are numbered row by row. Row 0 is at the upper end of the sensor, column 0 at its left, as in
a picture that the sensor takes: seen along its axis, with its up (the axis of its ring) on top.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...coverage.rings.ring import Group, Ring, Setup
from ...coverage.sensors.sensor import Sensor
from ...formats.ring_frame import MOST_ZONES

TURNS_DEG = (0, 90, 180, 270)


def zone_grid(sensor: Sensor) -> tuple[int, int]:
    """Return the rows of zones of a sensor, and the zones in a row, that its frames hold: (1, 1)
    for a sensor of one zone, and for one of more than a frame holds.
    """
    if sensor.zones == 1:
        return 1, 1
    return (sensor.rows, sensor.zones) if sensor.rows * sensor.zones <= MOST_ZONES else (1, 1)


def zoned(setup: Setup) -> list[int]:
    """Return the numbers of the rings and single sensors whose frames have zones."""
    return [i for i, g in enumerate(setup.groups) if zone_grid(g.sensor) != (1, 1)]


@dataclass(frozen=True)
class GridTurn:
    """How a grid of zones arrives: turned, and mirrored before, from how it is meant."""

    turn_deg: int = 0
    """Angle by which the sensor is turned about its axis, counter-clockwise in its picture's plane
    as seen along the axis: 0, 90, 180 or 270 degrees."""
    mirrored: bool = False
    """Whether left and right of the picture are exchanged."""

    def arrives(self, grid: Any) -> Any:
        """Return the grid (..., r, c) that arrives of zones that see ``grid`` (..., r, c).

        A picture of a camera that is turned counter-clockwise turns clockwise.
        """
        turned = np.rot90(grid, -self.turn_deg // 90, axes=(-2, -1))
        return turned[..., ::-1] if self.mirrored else turned

    def meant(self, grid: Any) -> Any:
        """Return the grid (..., r, c) that the zones see when ``grid`` (..., r, c) arrives."""
        grid = grid[..., ::-1] if self.mirrored else grid
        return np.rot90(grid, self.turn_deg // 90, axes=(-2, -1))

    def after(self, first: "GridTurn") -> "GridTurn":
        """Return the turn of a grid that arrives through ``first``, and then through this one."""
        number = np.arange(4).reshape(2, 2)
        both = self.arrives(first.arrives(number))
        return next(g for g in every_turn(2, 2) if (g.arrives(number) == both).all())

    def text(self) -> str:
        """Describe the turn."""
        each = [f"turned by {self.turn_deg}°"] * bool(self.turn_deg) + ["mirrored"] * self.mirrored
        return " and ".join(each) or "as stated"


def stated_turn(group: Group) -> GridTurn:
    """Return how the grids of a ring's sensors are stated to arrive."""
    if isinstance(group, Ring):
        return GridTurn(group.zone_turn_deg, group.zone_mirrored)
    return GridTurn()


def every_turn(rows: int, columns: int) -> list[GridTurn]:
    """Return the turns after which a grid has as many rows and columns as before."""
    turns = TURNS_DEG if rows == columns else TURNS_DEG[::2]
    return [GridTurn(turn, mirrored) for mirrored in (False, True) for turn in turns]
