"""Boards that carry a sensor: outline, holes and lens position, from the published files of
commercial boards.

Lengths are in metres, seen from the front: x to the right, y up, from the middle of the board.
"""

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from ..definitions.definition import definition, refuse
from ..definitions.field_types import Items, Pair

MM = 0.001  # m
# JST SH, side entry: 2.95 mm above the board, by the maker's sheet; the room beyond the edge, for
# the housing of the plug and the bend of its wires, is an estimate
_SH_REACH, _SH_HEIGHT = 7 * MM, 3 * MM
PLUG_HALF = 3 * MM
"""Half the width of the room of a plug along its edge, or half the edge where that is less, m."""
PACKAGE = (4.9 * MM, 2.5 * MM)
"""Size of a sensor's package along the ring and up the board, m."""
_Small = Annotated[float, Field(gt=0, le=0.2)]
_Room = Annotated[float, Field(ge=0, le=0.1)]
_Place = Pair[Annotated[float, Field(ge=-0.1, le=0.1, description="coordinate from the middle, m")]]


@definition
class Board:
    """The board that carries a sensor, seen from the front; x points right, y up, from its
    middle."""

    width: _Small
    """Width of the board, m."""
    height: _Small
    """Height of the board, m."""
    thickness: _Small = 0.0016
    """Thickness of the board, m."""
    lens: _Place = (0.0, 0.0)
    """Position of the middle of the sensor's package, m."""
    lens_height: _Room = 0.001
    """Height of the package's front above the board's front, m."""
    holes: Annotated[Items[_Place], Field(max_length=16)] = ()
    """Positions of the screw holes, m."""
    hole: _Small = 0.0025
    """Diameter of the holes, m."""
    plugs: Pair[_Room] = (0.0, 0.0)
    """Room for plugs and the bend of their wires beyond the edges left and right, and above and
    below, m."""
    plug_height: _Room = 0.003
    """Height of plugs, and of other parts under a lid, above the board's front, m."""
    source: Annotated[str, Field(max_length=1000)] = ""
    """Source of the figures."""

    def __post_init__(self) -> None:
        half = (self.width / 2, self.height / 2)
        spots: list[tuple[tuple[str | int, ...], tuple[float, float], float]]
        spots = [(("lens",), self.lens, 0.0)]
        spots += [(("holes", i), at, self.hole / 2) for i, at in enumerate(self.holes)]
        refuse(
            (loc, str([*at]), f"within the outline of {self.width:g} by {self.height:g} m")
            for loc, at, radius in spots
            if any(abs(x) + radius > h for x, h in zip(at, half, strict=True))
        )

    @property
    def turned(self) -> "Board":
        """The same board rotated by a quarter turn, so that its height runs along the ring."""
        return replace(
            self,
            width=self.height,
            height=self.width,
            lens=(-self.lens[1], self.lens[0]),
            holes=tuple((-y, x) for x, y in self.holes),
            plugs=self.plugs[::-1],
        )


def _four(x: float, y: float) -> tuple[tuple[float, float], ...]:
    return tuple((sx * x, sy * y) for sx in (-1.0, 1.0) for sy in (-1.0, 1.0))


def _stemma(name: str, repository: str, lens_height: float, sheet: str) -> Board:
    """Return one of Adafruit's boards of 1 by 0.7 inches.

    It has four holes 0.1 inch from the edges and the sensor in the middle.
    """
    source = f"{name}: github.com/adafruit/{repository}, board file; height of the package: {sheet}"
    return Board(
        25.4 * MM,
        17.78 * MM,
        1.6 * MM,
        (0.0, 0.0),
        lens_height,
        _four(10.16 * MM, 6.35 * MM),
        2.5 * MM,
        source=source,
        plugs=(_SH_REACH, 0.0),
        plug_height=_SH_HEIGHT,
    )


VL53L0X = _stemma(
    "Adafruit VL53L0X, STEMMA QT",
    "Adafruit-VL53L0X-ToF-Distance-Sensor-PCB",
    1.0 * MM,
    "ST, DS11555, technical specification: 4.4 x 2.4 x 1 mm",
)
VL53L1X = _stemma(
    "Adafruit VL53L1X",
    "Adafruit-VL53L1X-PCB",
    1.56 * MM,
    "ST, DocID031281, features: 4.9 x 2.5 x 1.56 mm",
)
VL53L4CD = _stemma(
    "Adafruit VL53L4CD",
    "Adafruit-VL53L4CD-PCB",
    1.0 * MM,
    "4.4 x 2.4 x 1 mm, maker's product page as quoted by third parties",
)
VL53L5CX = Board(
    25.4 * MM,
    25.4 * MM,
    1.6 * MM,
    (0.0, 0.0),
    1.5 * MM,
    _four(10.16 * MM, 10.16 * MM),
    3.302 * MM,
    source="SparkFun Qwiic ToF Imager: github.com/sparkfun/SparkFun_Qwiic_ToF_Imager_VL53L5CX,"
    " board file; height of the package: ST, DS13754, table 1, as quoted by a third party:"
    " 6.4 x 3.0 x 1.5 mm",
    plugs=(_SH_REACH, 0.0),
    plug_height=_SH_HEIGHT,
)
NOMINAL = Board(
    13.0 * MM,
    18.0 * MM,
    1.6 * MM,
    source="nominal board of a sensor whose own is unknown: a common small carrier, with wires"
    " soldered to it",
    plugs=(0.0, 4.0 * MM),
)
"""The board that is assumed where a sensor's own is not known: it gives such a ring an envelope,
but it cannot be printed."""
