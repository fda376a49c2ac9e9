"""Lids that cover the boards of a printed ring: a plate in front of each board, held by the board's
own screws, with a window for the beam.

All lengths are metres in the frame of a sensor: x along the ring, y up the board, z along the beam,
with the origin at the lens.
"""

import math
from dataclasses import dataclass

from .boards import PLUG_HALF, Board
from .sensor import Sensor

MARGIN = 0.0005
"""Distance between a window's edge and the beam of any point of the sensor's package, m."""
PACKAGE = 0.0064
"""Side of the square about the lens that contains the package of each sensor of the catalogue, the
longest of which is 6.4 mm long, m."""
SCREW_HEAD = 0.0025
"""Height of the heads of the screws that hold boards and lids, m; they are twice as wide as the
board's holes."""
_THICK = 1.25  # thickness of a lid's walls, relative to the least wall that may be measured
_SCREW_PLAY = 0.0001  # m, between a screw and its hole in a lid, in radius beyond the board's hole
_WIDEST = math.radians(85)  # half angle of a beam for which a window is computed


@dataclass(frozen=True)
class Lid:
    """The dimensions of the lids of one board, m."""

    board: Board
    """The board, as it is turned."""
    clearance: float
    """Clearance between lid and board, ring and plugs."""
    thick: float
    """Thickness of the plate, the rim and the walls around the screws."""

    @property
    def under(self) -> float:
        """Distance from the lens forwards to the plate's rear face: clear of the plugs and of the
        sensor."""
        board = self.board
        return max(board.plug_height, board.lens_height) + self.clearance - board.lens_height

    @property
    def front(self) -> float:
        """Distance from the lens forwards to the plate's front."""
        return self.under + self.thick

    @property
    def back(self) -> float:
        """Distance from the lens forwards to the rim's rear end; negative.

        The ring's front lies half a board's thickness behind the board's front. The rim ends a
        clearance ahead of it, so that the screws press the lid onto the board.
        """
        return self.clearance - self.board.thickness / 2 - self.board.lens_height

    @property
    def grip(self) -> float:
        """Length of a screw in the lid and the board."""
        return self.front + self.board.lens_height + self.board.thickness

    def extent(self, beyond: float = 0.0) -> tuple[float, float, float, float]:
        """Return the outline of the room inside the rim, enlarged by ``beyond`` m: lowest and
        highest x, lowest and highest y."""
        board, by = self.board, self.clearance + beyond
        (x, y), w, h = board.lens, board.width / 2 + by, board.height / 2 + by
        return -w - x, w - x, -h - y, h - y

    @property
    def outline(self) -> tuple[float, float, float, float]:
        """Lowest and highest x, lowest and highest y of the lid."""
        return self.extent(self.thick)

    @property
    def half(self) -> float:
        """Largest distance of lid and screw heads from the lens along the ring."""
        x0, x1, *_ = self.outline
        return max([-x0, x1, *(abs(x) + self.board.hole for x, _ in self.spots)])

    @property
    def low(self) -> float:
        """Extent of lid and screw heads downwards from the lens; negative."""
        return min([self.outline[2], *(y - self.board.hole for _, y in self.spots)])

    @property
    def high(self) -> float:
        """Extent of lid and screw heads upwards from the lens."""
        return max([self.outline[3], *(y + self.board.hole for _, y in self.spots)])

    @property
    def spots(self) -> list[tuple[float, float]]:
        """Centres (x, y) of the screws."""
        u, v = self.board.lens
        return [(x - u, y - v) for x, y in self.board.holes]

    @property
    def hole(self) -> float:
        """Radius of the holes for the screws."""
        return self.board.hole / 2 + _SCREW_PLAY

    @property
    def boss(self) -> float:
        """Radius of the bosses around the screws, which rest on the board."""
        return self.hole + self.thick

    def window(self, sensor: Sensor, ahead: float) -> tuple[float, float]:
        """Return half the width and height of the window ``ahead`` m in front of the lens."""
        angles = (sensor.half_angle, sensor.half_angle_up or sensor.half_angle)
        x, y = (math.tan(min(angle, _WIDEST)) * max(ahead, 0.0) for angle in angles)
        free = max(PACKAGE / 2, sensor.aperture) + MARGIN
        return free + x, free + y

    def fault(self, sensor: Sensor) -> str | None:
        """Return a message on why the beams of ``sensor`` or the plugs leave no room for a lid;
        None if they do."""
        if self._plugs_meet_screws():
            return "the board's plugs stand where the screws of a lid would"
        wide, high = self.window(sensor, self.front)
        x0, x1, y0, y1 = self.extent()
        size = f"a window of {2000 * wide:.1f} × {2000 * high:.1f} mm for the beam"
        if min(min(-x0, x1) - wide, min(-y0, y1) - high) < 0:
            return f"{size} meets the edge of a lid"
        for ahead, radius in ((self.front, self.boss), (self.front + SCREW_HEAD, self.board.hole)):
            wide, high = self.window(sensor, ahead)
            if any(max(abs(x) - wide, abs(y) - high) < radius for x, y in self.spots):
                return f"{size} meets the screws of a lid"
        return None

    def _plugs_meet_screws(self) -> bool:
        """Whether the rim's opening for a plug leaves a screw less than a wall."""
        board, least = self.board, self.hole + self.thick
        sides = (board.width / 2, board.height / 2)
        for at in board.holes:
            for side in (0, 1):
                plug = min(PLUG_HALF, sides[1 - side]) + self.clearance
                beside = max(abs(at[1 - side]) - plug, 0.0)
                if board.plugs[side] and math.hypot(beside, sides[side] - abs(at[side])) < least:
                    return True
        return False


def lid_of(board: Board, clearance: float, least_wall: float) -> Lid | None:
    """Return the lids of a board; None for a board without holes, which is glued.

    Args:
        board: the board, as it is turned.
        clearance: clearance around a board in its pocket, m.
        least_wall: minimum thickness that may be measured, m.
    """
    return Lid(board, clearance, _THICK * least_wall) if board.holes else None


def lid_fault(board: Board, sensor: Sensor, clearance: float, least_wall: float) -> str | None:
    """Return a message on why a board with ``sensor`` cannot have a lid, however it is turned; None
    if it can. For the arguments see ``lid_of``."""
    lid = lid_of(board, clearance, least_wall)
    if lid is None:
        return "the sensor's board has no holes for screws and is glued"
    turned = Lid(board.turned, lid.clearance, lid.thick)
    return lid.fault(sensor) or turned.fault(sensor)
