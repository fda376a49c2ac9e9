"""Packing of boards around a link: the pockets of a printed ring that hold the boards, and when two
pockets collide.

In the plane of a sensor's axis and its ring's axis, the pocket is a rectangle about the sensor's
axis, tilted with it. Along the ring it is as wide as the board. A ring is printed with its beams
leaning upwards, however it is mounted, so the sign of a tilt is irrelevant here. Neighbours are
mirror images in the half plane through the ring's axis midway between them. They are therefore
separated by a wall and by the gap of the halves exactly if each keeps half of both from the half
plane. The corners that first reach that half plane are those nearest to the ring's axis, at the
pocket's ``floor``.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import definition, refuse
from ..definitions.field_types import Triple
from ..definitions.units import Millimetres
from .boards import Board
from .lids import Lid, lid_of

_STEPS = 181  # number of tilts in a quarter turn at which counts are computed
_TILTS = np.linspace(0.0, math.pi / 2, _STEPS)[:-1]
_ROUNDING = 1e-9
_SideMm = Annotated[float, Millimetres("bed_mm", ge=20, le=5000)]


@definition
class Printing:
    """Parameters of printed rings."""

    wall: Annotated[float, Field(ge=0.0008, le=0.05)] = 0.003
    """Least thickness of load-bearing walls, m."""
    clearance: Annotated[float, Field(ge=0, le=0.005)] = 0.0003
    """Clearance of a board in its pocket on every side, m."""
    slack: Annotated[float, Field(ge=0, le=0.02)] = 0.0005
    """Clearance between ring and link, m."""
    relief: Annotated[float, Field(ge=0, le=0.05)] = 0.002
    """Free depth behind a board, m."""
    bolt: Literal["M3", "M4", "M5"] = "M3"
    """Size of the bolts that close a ring."""
    nut: Literal["trap", "through"] = "trap"
    """Hexagonal trap for each nut, or a through hole."""
    fastening: Literal["nut", "insert"] = "nut"
    """What the bolts are screwed into: nuts, or heat-set inserts."""
    gap: Annotated[float, Field(ge=0, le=0.01)] = 0.001
    """Gap between the halves before the bolts are tightened, m."""
    channel: Annotated[float, Field(ge=0, le=0.02)] = 0.004
    """Width and depth of the cable groove, m."""
    least_wall: Annotated[float, Field(ge=0.0002, le=0.01)] = 0.0012
    """Smallest acceptable measured wall thickness, m."""
    overhang: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Largest share of the surface that may overhang by more than 45 degrees without support."""
    bed: Triple[_SideMm] | None = None
    """Width, depth and height that the printer can print; default: parts of any size, on plates of
    250 × 210 mm."""
    lettering: bool = True
    """Whether each part is engraved with its number, its link and an arrow to the wrist."""
    ties: bool = True
    """Whether each part has a bridge to which a cable tie holds the cables."""
    cover: bool = False
    """Whether each board has a lid, which its screws hold; left out where false."""

    def _as_table(self, table: dict[str, Any]) -> dict[str, Any]:
        """Return a table for files, which is the same without lids as before there were any."""
        return {key: value for key, value in table.items() if key != "cover" or value}

    def __post_init__(self) -> None:
        least = 2 * self.least_wall
        if self.wall < least:
            why = f"at least {least:g}, because half of it remains at a split"
            refuse([(("wall",), self.wall, why)])


@dataclass(frozen=True)
class Pocket:
    """A board's place on a ring, relative to the lens."""

    board: Board
    """The board, as it is turned."""
    half: float
    """Half the width along the ring, m."""
    low: float
    """Extent downwards across the sensor's axis, m; negative."""
    high: float
    """Extent upwards across the sensor's axis, m; positive."""
    deep: float
    """Depth behind the lens, m."""
    lid: Lid | None = None
    """The board's lid, if it has one."""

    def floor(self, radius: float, tilt: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
        """Return the distance of the pocket from the ring's axis, m.

        The ring has a radius of ``radius`` m and tilts (T,) rad.
        """
        gap: np.ndarray = radius - self.deep * np.cos(tilt) - self.high * np.abs(np.sin(tilt))
        return gap

    def innermost(self, radius: float, tilt: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
        """Return the distance of the pocket, of the board's plugs and of its lid from the ring's
        axis, m; for the arguments see ``floor``."""
        up = self.high + self.board.plugs[1]
        plug = radius - self.board.lens_height * np.cos(tilt) - up * np.abs(np.sin(tilt))
        least: np.ndarray = np.minimum(self.floor(radius, tilt), plug)
        return least if self.lid is None else np.minimum(least, _lid_floor(self.lid, radius, tilt))


@lru_cache(maxsize=256)
def pockets(board: Board, printing: Printing) -> tuple[Pocket, Pocket]:
    """Return a board's pockets with its narrow side along the ring, and with its wide side; the
    room of plugs belongs to a side."""
    wide, high = board.width + 2 * board.plugs[0], board.height + 2 * board.plugs[1]
    narrow = board if wide <= high else board.turned

    def pocket(b: Board) -> Pocket:
        half = b.width / 2 + b.plugs[0] + abs(b.lens[0]) + printing.clearance
        reach = b.height / 2 + printing.clearance
        return Pocket(
            b,
            half,
            -reach - b.lens[1],
            reach - b.lens[1],
            b.lens_height + b.thickness + printing.relief,
            lid_of(b, printing.clearance, printing.least_wall) if printing.cover else None,
        )

    return pocket(narrow), pocket(narrow.turned)


def _counts(
    pocket: Pocket, printing: Printing, radius: float, tilt: Float[np.ndarray, " T"], inside: float
) -> Float[np.ndarray, " T"]:
    slope = _slope(pocket.half, pocket.floor(radius, tilt), printing.wall + printing.gap)
    if pocket.lid is not None:
        lid = _slope(pocket.lid.half, _lid_floor(pocket.lid, radius, tilt), printing.clearance)
        slope = np.maximum(slope, lid)
    least = pocket.innermost(radius, tilt)
    held = least >= max(inside, 0.0) - _ROUNDING if inside else least > 0
    return np.where(held, np.maximum(np.floor(np.pi / slope + _ROUNDING), 1.0), 0.0)


def _slope(half: float, floor: Float[np.ndarray, " T"], apart: float) -> Float[np.ndarray, " T"]:
    """Return half the least angle (T,) rad between neighbours of half the width ``half`` m at
    distances ``floor`` (T,) m from the ring's axis that are ``apart`` m from each other."""
    across = np.hypot(floor, half)
    slope: np.ndarray = np.arctan2(half, floor) + np.arcsin(np.clip(apart / 2 / across, 0.0, 1.0))
    return slope


def _lid_floor(lid: Lid, radius: float, tilt: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Return the distance (T,) m of lids from the axis of a ring of ``radius`` m at ``tilt`` (T,)
    rad."""
    floor: np.ndarray = radius + lid.back * np.cos(tilt) - lid.high * np.abs(np.sin(tilt))
    return floor


def inner_radius(around: float, printing: Printing) -> float:
    """Return the minimum distance of pockets from the axis of a ring around a radius ``around``, m.

    It is 0 if the ring surrounds nothing.
    """
    return around + printing.slack + printing.wall if around > 0 else 0.0


def best_pocket(
    board: Board, printing: Printing, radius: float, tilt: float, inside: float = 0.0
) -> Pocket:
    """Return the pocket that allows more boards on a ring; if equal, the narrow one."""
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
    """Return the maximum sensor count of a ring at tilts (T,) rad; 0 where no board fits.

    Args:
        board: the board.
        printing: how the ring is printed.
        radius: radius of the ring, m.
        tilt: tilts (T,), rad.
        inside: minimum distance of pockets from the ring's axis, m.
    """
    first, second = (_counts(p, printing, radius, tilt, inside) for p in pockets(board, printing))
    count: np.ndarray = np.maximum(first, second)
    return count


@lru_cache(maxsize=256)
def _by_tilt(
    board: Board, printing: Printing, radius: float, inside: float
) -> Float[np.ndarray, " T"]:
    """Return the maximum counts at tilts from 0 to a quarter turn."""
    return most_boards(board, printing, radius, _TILTS, inside)


def tilt_range(
    board: Board, printing: Printing, radius: float, count: int, inside: float = 0.0
) -> tuple[float, float] | None:
    """Return the tilt interval around 0, in rad, on which ``count`` boards fit.

    Returns None if they do not fit at tilt 0.
    """
    fits = _by_tilt(board, printing, radius, inside) >= count
    if not fits[0]:
        return None
    most = float(_TILTS[-1] if fits.all() else _TILTS[np.argmin(fits) - 1])
    return -most, most


def roomy_radius(
    board: Board, printing: Printing, around: float, tilt: tuple[float, float]
) -> float:
    """Return the minimum radius of a ring, m, whose boards clear the link at every allowed tilt.

    Args:
        board: the board.
        printing: how the ring is printed.
        around: radius of the surrounded section, m.
        tilt: lowest and highest tilt, rad.
    """
    some = np.linspace(*tilt, _STEPS)
    inside = inner_radius(around, printing)
    return min(float(inside - p.innermost(0.0, some).min()) for p in pockets(board, printing))
