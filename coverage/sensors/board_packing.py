"""How many boards go around a link: the pockets of a printed ring that hold them, and when two of
these meet.

In the plane of a sensor's axis and its ring's axis the pocket is a rectangle about the sensor's
axis, tilted with it; along the ring it is as wide as the board. A ring is printed with its beams
leaning upwards, whichever way it is mounted, so that the sign of a tilt says nothing here.
Neighbours are mirror images in the half plane through the ring's axis midway between them, so that
they are apart by a wall, and by the gap of the halves, just when each stays half of both on its
side. The corners that come first to that half plane are those nearest to the ring's axis, at the
pocket's ``floor``.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from .boards import Board

_STEPS = 181  # tilts of a quarter turn that are looked at
_TILTS = np.linspace(0.0, math.pi / 2, _STEPS)[:-1]
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Printing:
    """How rings are printed, all lengths in m.

    wall: least thickness of what carries. clearance: of a board in its pocket, all around. slack:
    between ring and link. relief: free depth behind a board. bolt: nominal diameter of the two
    bolts that close a ring (M3 to M5); nut: a hexagonal trap for each nut, or a through hole. gap:
    between the halves before the bolts are drawn. channel: width and depth of the groove for
    cables. least_wall: thinnest that may be measured anywhere. overhang: largest share of the
    surface that may hang over by more than 45 degrees without support.
    """

    wall: float = 0.003
    clearance: float = 0.0003
    slack: float = 0.0005
    relief: float = 0.002
    bolt: float = 0.003
    nut: bool = True
    gap: float = 0.001
    channel: float = 0.004
    least_wall: float = 0.0012
    overhang: float = 0.05


@dataclass(frozen=True)
class Pocket:
    """A board's place on a ring, from the lens: half its width along the ring, how far it reaches
    down and up across the sensor's axis (low < 0 < high), and how deep behind the lens, m;
    ``board`` as it is turned."""

    board: Board
    half: float
    low: float
    high: float
    deep: float

    def floor(self, radius: float, tilt: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
        """How far the pocket stays from the ring's axis, m, on a ring of ``radius`` m at tilts (T,)
        rad.
        """
        gap: np.ndarray = radius - self.deep * np.cos(tilt) - self.high * np.abs(np.sin(tilt))
        return gap


def pockets(board: Board, printing: Printing) -> tuple[Pocket, Pocket]:
    """The pocket of a board with its narrow side along the ring, and with the other."""
    narrow = board if board.width <= board.height else board.turned

    def pocket(b: Board) -> Pocket:
        half = b.width / 2 + abs(b.lens[0]) + printing.clearance
        reach = b.height / 2 + printing.clearance
        return Pocket(
            b,
            half,
            -reach - b.lens[1],
            reach - b.lens[1],
            b.lens_height + b.thickness + printing.relief,
        )

    return pocket(narrow), pocket(narrow.turned)


def _counts(
    pocket: Pocket, printing: Printing, radius: float, tilt: Float[np.ndarray, " T"], inside: float
) -> Float[np.ndarray, " T"]:
    floor = pocket.floor(radius, tilt)
    across = np.hypot(floor, pocket.half)
    slope = np.arctan2(pocket.half, floor) + np.arcsin(
        np.clip((printing.wall + printing.gap) / 2 / across, 0.0, 1.0)
    )
    held = floor >= max(inside, 0.0) - _ROUNDING if inside else floor > 0
    return np.where(held, np.maximum(np.floor(np.pi / slope + _ROUNDING), 1.0), 0.0)


def inner_radius(around: float, printing: Printing) -> float:
    """How near pockets may come to the ring's axis, m, where a ring surrounds ``around`` m; 0 where
    nothing is.
    """
    return around + printing.slack + printing.wall if around > 0 else 0.0


def best_pocket(
    board: Board, printing: Printing, radius: float, tilt: float, inside: float = 0.0
) -> Pocket:
    """The pocket of which more go around a ring; of equals that of the narrow side."""
    each = pockets(board, printing)
    first, second = (_counts(p, printing, radius, np.array([tilt]), inside)[0] for p in each)
    return each[1] if second > first else each[0]


def most_boards(
    board: Board,
    printing: Printing,
    radius: float,
    tilt: Float[np.ndarray, " T"],
    inside: float = 0.0,
) -> Float[np.ndarray, " T"]:
    """The largest count of a ring of ``radius`` m at tilts (T,) rad, pockets at least ``inside`` m
    from its axis; 0 where there is no place for any."""
    first, second = (_counts(p, printing, radius, tilt, inside) for p in pockets(board, printing))
    count: np.ndarray = np.maximum(first, second)
    return count


@lru_cache(maxsize=256)
def _by_tilt(
    board: Board, printing: Printing, radius: float, inside: float
) -> Float[np.ndarray, " T"]:
    """The largest counts at tilts from 0 to a quarter turn."""
    return most_boards(board, printing, radius, _TILTS, inside)


def tilt_range(
    board: Board, printing: Printing, radius: float, count: int, inside: float = 0.0
) -> tuple[float, float] | None:
    """The tilts about 0, lowest and highest, rad, at all of which ``count`` boards go around; None
    where 0 is not one.
    """
    fits = _by_tilt(board, printing, radius, inside) >= count
    if not fits[0]:
        return None
    most = float(_TILTS[-1] if fits.all() else _TILTS[np.argmin(fits) - 1])
    return -most, most


def roomy_radius(
    board: Board, printing: Printing, around: float, tilt: tuple[float, float]
) -> float:
    """The least radius of a ring, m, whose boards clear what it surrounds, ``around`` m, at every
    tilt between two, rad.
    """
    some = np.linspace(*tilt, _STEPS)
    inside = inner_radius(around, printing)
    return min(float(inside - p.floor(0.0, some).min()) for p in pockets(board, printing))
