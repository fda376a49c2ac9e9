"""Directions and places as text."""

import math

import numpy as np
from jaxtyping import Float

from ...objectives.blind_spots import Beside
from ..pages import escaped
from ..text import listed

_AROUND = 0.5  # a mean direction shorter than this means that a piece lies on all sides
_MOST = 0.7  # share of a piece next to one body that makes it the only one named
_NOTED = 0.35  # components of a unit vector of at least this size are named


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


def beside(found: Beside | None) -> str:
    """Return the place of a piece relative to the robot: ``above the forearm, towards +x``."""
    if found is None:
        return ""
    body, length = plain(found.body), float(np.linalg.norm(found.way))
    if length < _AROUND:
        return (
            f"around the {body}"
            if found.share >= _MOST
            else f"around the robot, the largest part by the {body}"
        )
    way = found.way / length
    level = "above" if way[2] >= _NOTED else "below" if way[2] <= -_NOTED else "beside"
    return f"{level} the {body}" + (f", towards {listed(side)}" if (side := sides(way)) else "")


def metres(point: Float[np.ndarray, " 3"]) -> str:
    """Format three lengths in m."""
    return ", ".join(f"{v + 0.0:.2f}" for v in np.round(point, 2))
