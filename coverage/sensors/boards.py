"""Boards that carry a sensor: outline, holes and lens position, from the published files of
commercial boards.

Lengths are in metres, seen from the front: x to the right, y up, from the middle of the board.
"""

from dataclasses import dataclass, replace

MM = 0.001  # m
# JST SH, side entry: 2.95 mm above the board, by the maker's sheet; the room beyond the edge, for
# the housing of the plug and the bend of its wires, is an estimate
_SH_REACH, _SH_HEIGHT = 7 * MM, 3 * MM
PLUG_HALF = 3 * MM
"""Half the width of the room of a plug along its edge, or half the edge where that is less, m."""


@dataclass(frozen=True)
class Board:
    """A board with one sensor."""

    width: float
    """Width of the outline, m."""
    height: float
    """Height of the outline, m."""
    thickness: float
    """Thickness of the board, m."""
    lens: tuple[float, float] = (0.0, 0.0)
    """Middle of the sensor's package from the middle of the outline, (x, y) m."""
    lens_height: float = 0.001
    """Height of the package's front above the board's front, m."""
    holes: tuple[tuple[float, float], ...] = ()
    """Centres of the screw holes, (x, y) m."""
    hole: float = 0.0025
    """Diameter of the screw holes, m."""
    source: str = ""
    """Source of the dimensions."""
    plugs: tuple[float, float] = (0.0, 0.0)
    """Room for plugs and the bend of their wires beyond the edges left and right, and beyond those
    above and below, m; 0: none."""
    plug_height: float = 0.003
    """Height of plugs, and of the tallest other part, above the board's front, m."""

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
