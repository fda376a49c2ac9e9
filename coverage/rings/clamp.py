"""Dimensions of the clamp that carries a ring's boards: a band around the link, blocks on it for
the boards, and ears for the two bolts that close it.

All lengths are metres in the frame in which a clamp is printed: z points along the ring's axis
towards the side to which the beams lean, and the lenses lie in the plane z = 0.
"""

import math
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np

from ..sensors.board_packing import Pocket, Printing, best_pocket, inner_radius
from ..sensors.boards import Board
from ..sensors.lids import SCREW_HEAD

FRONT = 0.006
"""Depth in front of a lens that the clamp leaves free, m; of lids more where they need it."""
NUT_CLEARANCE = 0.00015
"""Clearance of a nut in its trap, on each side, m."""
NUT_COVER = 0.0003
"""Material between a nut and the split, m."""
_LIFT = 0.0005  # m, from the pockets up to the ears
_PLUG_GAP = 0.0005  # m, from plugs and lids up to the ears


@dataclass(frozen=True)
class Bolt:
    """A bolt with its nut, m."""

    head: float
    """Diameter of the head."""
    nut: float
    """Width of the nut across flats."""
    nut_height: float
    """Height of the nut."""
    hole: float
    """Diameter of the clearance hole."""
    size: float
    """Nominal diameter, which is also the height of the head."""

    @property
    def widest(self) -> float:
        """Distance from the axis to a corner of the nut trap, m."""
        return (self.nut / 2 + NUT_CLEARANCE) / math.cos(math.pi / 6)

    def scaled(self, by: float) -> "Bolt":
        """Return the bolt with its lengths in another unit, of which a metre has ``by``."""
        return Bolt(*(by * length for length in astuple(self)))


@dataclass(frozen=True)
class Insert:
    """A heat-set insert, m."""

    hole: float
    """Diameter of the hole into which it is melted."""
    length: float
    """Length."""


# head, nut (ISO 4762, 4032), nut height, hole (ISO 273)
BOLTS = {
    3: Bolt(0.0055, 0.0055, 0.0024, 0.0034, 0.003),
    4: Bolt(0.0070, 0.0070, 0.0032, 0.0045, 0.004),
    5: Bolt(0.0085, 0.0080, 0.0047, 0.0055, 0.005),
}
"""Bolts by their nominal diameter in millimetres."""
# holes: Accu, pilot hole sizes of heat-set inserts in printed PLA, PETG and ABS; lengths: the usual
# ones for printed parts, as sold by Ruthex and CNC Kitchen
INSERTS = {3: Insert(0.0040, 0.0057), 4: Insert(0.0056, 0.0081), 5: Insert(0.0064, 0.0095)}
"""Heat-set inserts by the nominal diameter of their thread in millimetres."""
INSERT_SOURCE = (
    "hole: Accu, pilot holes of heat-set inserts for printed plastic; length: standard inserts of"
    " Ruthex and CNC Kitchen"
)
"""Source of the inserts' figures."""
MELT = 0.0005
"""Depth that a hole leaves for the plastic that an insert displaces, m."""


@dataclass(frozen=True)
class Clamp:
    """The dimensions of a clamp, m."""

    printing: Printing
    """Printing parameters."""
    pocket: Pocket
    """Pocket of each board."""
    tilt: float
    """Tilt, rad, not negative."""
    radius: float
    """Radius of the circle of lenses."""
    link: float
    """Radius of the link."""
    inner: float
    """Least radius of the pockets."""
    bolt: Bolt
    """The bolts."""

    @property
    def wall(self) -> float:
        """Thickness of load-bearing walls."""
        return self.printing.wall

    @property
    def bore(self) -> float:
        """Radius of the hole for the link."""
        return self.link + self.printing.slack

    @property
    def collar(self) -> float:
        """Outer radius of the band around the hole."""
        return self.bore + self.wall

    @property
    def seat(self) -> float:
        """Distance from the lens back to a board's rear face."""
        return self.pocket.board.lens_height + self.pocket.board.thickness

    @property
    def rim(self) -> float:
        """Distance from the lens back to the clamp's front: half a board's thickness in front of
        the board's rear face."""
        return self.seat - self.pocket.board.thickness / 2

    @property
    def half(self) -> float:
        """Half the width of a block that carries a board."""
        return self.pocket.half + self.wall

    @property
    def outermost(self) -> float:
        """Distance of a block's outer end from the ring's axis."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        return self.radius - self.rim * c - self.pocket.low * s + self.wall

    @property
    def low(self) -> float:
        """Lower end of the blocks."""
        pocket = self.pocket
        return pocket.low * math.cos(self.tilt) - pocket.deep * math.sin(self.tilt) - self.wall

    @property
    def top(self) -> float:
        """Upper end of the blocks."""
        return self.pocket.high * math.cos(self.tilt) - self.seat * math.sin(self.tilt)

    @property
    def across(self) -> float:
        """Distance of the bolts' axes from the link's axis."""
        return self.collar + self.bolt.head / 2

    @property
    def reach(self) -> float:
        """Extent of an ear from the split."""
        nut = self.wall + self.bolt.nut_height + NUT_COVER
        if self.printing.fastening == "nut":
            return nut
        insert = INSERTS[round(1000 * self.bolt.size)]
        return max(nut, self.printing.gap / 2 + insert.length + MELT)

    @property
    def ear(self) -> float:
        """Distance of an ear's outer end from the link's axis."""
        widest = max(self.bolt.head, self.bolt.nut + 2 * NUT_CLEARANCE)
        return self.across + widest / 2 + self.wall / 2

    @cached_property
    def lug(self) -> tuple[float, float]:
        """Lower and upper end of the ears.

        They stand above the pockets, which would weaken them, above the space in front of the
        lenses where they would reach into it, and above plugs and lids that would meet them.
        """
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        # where the upper edge of a pocket crosses the plane of its lens
        edge = self.radius - self.pocket.high * s
        outer = math.hypot(self.ear, self.reach)
        under = (outer - edge) / max(c, 1e-9)
        low = self.top + (self.seat + min(max(under, 0.0), self.front)) * s + _LIFT
        board, lid = self.pocket.board, self.pocket.lid
        ends = list[tuple[float, float, float]]()  # up, and rear and front of plugs and lids
        if board.plugs[1]:
            ends.append((self.pocket.high + board.plugs[1], -board.lens_height, self.on_board))
        if lid is not None:
            ends.append((lid.high, lid.back, self.in_front))
        for up, back, front in ends:
            inside = self.radius + back * c - up * s  # distance of plugs or lid from the axis
            if inside < self.bolted:
                # the slope under an ear must clear them, too
                slope = max(self.ear - inside, 0.0)
                low = max(low, up * c + front * s + slope + _PLUG_GAP)
        return low, low + 2 * self.bolt.widest + self.wall

    @cached_property
    def bolted(self) -> float:
        """Distance from the mount axis within which ears and bolts lie."""
        bolt = self.bolt
        head = math.hypot(self.across + bolt.head / 2, self.reach + bolt.size)
        trapped = self.printing.nut == "trap" or self.printing.fastening == "insert"
        proud = 0.0 if trapped else bolt.nut_height
        nut = math.hypot(self.across + bolt.widest, self.reach + proud)
        return max(math.hypot(self.ear, self.reach), head, nut)

    @property
    def in_front(self) -> float:
        """Distance from the plane of a lens forwards to the ends of plugs, lids and screw heads."""
        lid = self.pocket.lid
        return self.on_board if lid is None else lid.front + SCREW_HEAD

    @property
    def on_board(self) -> float:
        """Distance from the plane of a lens forwards to the ends of plugs, and of the heads of
        screws on a board without a lid."""
        board = self.pocket.board
        heads = SCREW_HEAD if board.holes and self.pocket.lid is None else 0.0
        return max(heads, board.plug_height if any(board.plugs) else 0.0) - board.lens_height

    @property
    def front(self) -> float:
        """Depth in front of a lens that the clamp leaves free."""
        if self.pocket.lid is None:
            return FRONT
        return max(FRONT, self.in_front + self.printing.clearance)

    @property
    def foot(self) -> float:
        """Lower end of the slope of 45 degrees that supports an ear."""
        return self.lug[0] - (self.ear - self.bore)

    @property
    def groove(self) -> tuple[float, float]:
        """Inner and outer radius of the cable channel."""
        floor = float(self.pocket.floor(self.radius, np.array([self.tilt]))[0])
        back = max(self.inner, floor - self.printing.channel)
        return back, back + self.printing.channel


def clamp_of(
    around: float,
    radius: float,
    tilt: float,
    board: Board,
    printing: Printing,
) -> Clamp:
    """Return the clamp of a ring.

    Where the section of the link is unknown, the hole is assumed to end a wall behind the pockets.

    Args:
        around: radius that the ring must surround, m, as ``surrounded`` gives it; 0: unknown.
        radius: radius of the ring, m.
        tilt: tilt of the ring, rad.
        board: the board of its sensors.
        printing: printing parameters.
    """
    tilt = abs(tilt)
    inner = inner_radius(around, printing)
    pocket = best_pocket(board, printing, radius, tilt, inner)
    tube = around
    if around <= 0:
        floor = float(pocket.floor(radius, np.array([tilt]))[0])
        tube = max(floor - printing.wall - printing.slack, 0.0)
    bolt = BOLTS[int(printing.bolt[1:])]
    return Clamp(printing, pocket, tilt, radius, tube, inner, bolt)
