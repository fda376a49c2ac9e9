"""Directions and places as text."""

import math

import numpy as np
from jaxtyping import Float

from ...objectives.blind_spots import BlindSpot
from ..pages import escaped
from ..text import listed

_NOTED = 0.35  # components of a unit vector of at least this size are named
_WAYS = (("in front of", "behind"), ("left of", "right of"), ("above", "below"))


def plain(name: str) -> str:
    """Return a readable name of a link or a body, safe in Markdown."""
    return escaped(name.replace("_", " "))


def sides(way: Float[np.ndarray, " 3"]) -> list[str]:
    """Return the horizontal axes of the base frame that a unit vector leans to: ``+x``, ``−y``."""
    order = sorted((0, 1), key=lambda i: -abs(way[i]))
    return [f"{'+' if way[i] > 0 else '−'}{'xy'[i]}" for i in order if abs(way[i]) >= _NOTED]


def heading(way: Float[np.ndarray, " 3"]) -> str:
    """Return a unit vector's direction in the base frame: ``up``, ``down and towards +x``,
    ``towards −y``.
    """
    upright = ["up" if way[2] > 0 else "down"] if abs(way[2]) >= _NOTED else []
    towards = [f"towards {listed(found)}"] if (found := sides(way)) else []
    return " and ".join([*upright, *towards])


def bearing(way: Float[np.ndarray, " 3"]) -> str:
    """Return a unit vector's azimuth from +x towards +y, and its elevation, in degrees."""
    azimuth, elevation = (
        math.degrees(math.atan2(way[1], way[0])),
        math.degrees(math.asin(float(np.clip(way[2], -1, 1)))),
    )
    return f"azimuth {round(azimuth) % 360}°, elevation {round(elevation):+d}°"


def height(spot: BlindSpot) -> str:
    """Return how high a blind spot is: ``0.30 to 0.62 m high``, or relative to the base."""
    low, high = spot.height
    if low >= 0:
        return f"{low:.2f} to {high:.2f} m high"
    if high <= 0:
        return f"{-high:.2f} to {-low:.2f} m below the base"
    return f"{-low:.2f} m below to {high:.2f} m above the base"


def whereabouts(spot: BlindSpot) -> str:
    """Return the side of the robot on which a blind spot lies: ``behind and above the forearm``."""
    way = spot.beside.way
    order = sorted(range(3), key=lambda i: -abs(way[i]))
    names = [_WAYS[i][int(way[i] < 0)] for i in order if abs(way[i]) >= _NOTED]
    body = plain(spot.beside.body)
    return f"{listed(names)} {'' if body[-1:].isdigit() else 'the '}{body}"


def axis_name(way: Float[np.ndarray, " 3"]) -> str:
    """Return the axis of a frame nearest to a vector: ``+x``, ``−z``."""
    i = int(np.argmax(np.abs(way)))
    return f"{'+' if way[i] > 0 else '−'}{'xyz'[i]}"


def metres(point: Float[np.ndarray, " 3"]) -> str:
    """Format three lengths in m."""
    return ", ".join(f"{v + 0.0:.2f}" for v in np.round(point, 2))
