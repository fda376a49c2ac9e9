"""A fan of rays through the zones of a sensor, and the targets that they find.

A zone is a part of the sensor's section, from the apex on. A fan of 5 by 5 rays, border included,
measures each; a beam without zones has one of 33 by 33. The first target is the nearest ray, as the
first return of a whole beam is.
"""

import numpy as np
from jaxtyping import Float

from ...coverage.arrays import dot
from ...coverage.solids.beams import Beams

SEPARATION = 0.6  # m between two targets of a zone (ST, UM2884, for the VL53L5CX)
ZONE_STEPS, BEAM_STEPS = 4, 32
"""Steps between the rays along a side, of a zone and of a beam without zones."""


def steps_of(rows: int, columns: int) -> int:
    """Return the steps between the rays of a zone, along a side."""
    return ZONE_STEPS if rows * columns > 1 else BEAM_STEPS


def fan_places(rows: int, columns: int, steps: int) -> Float[np.ndarray, "N 2"]:
    """Return the places of a fan's rays in the section of a beam, as ``Beams.ways`` takes them:
    from the upper left of the picture on, row by row."""
    up = np.linspace(1, -1, steps * rows + 1)
    left = np.linspace(1, -1, steps * columns + 1)  # along up x axis, which points left
    return np.stack(np.meshgrid(left, up), axis=-1).reshape(-1, 2)


def fan_rays(
    beams: Beams, places: Float[np.ndarray, "N 2"]
) -> tuple[Float[np.ndarray, "B N 3"], Float[np.ndarray, "B N"]]:
    """Return unit rays of all beams, and the lengths in the beams, m."""
    way = beams.ways(np.arange(len(beams)), np.repeat(places[None], len(beams), axis=0))
    longer = np.sqrt(dot(way, way))
    return way / longer[..., None], np.asarray(beams.range_m)[:, None] * longer


def zone_targets(
    distance: Float[np.ndarray, "B N"],
    grid: tuple[int, int],
    steps: int,
    targets: int,
    separation: float = SEPARATION,
) -> Float[np.ndarray, "B r c t"]:
    """Return the targets of each zone, nearest first, m; infinite where there is none.

    Args:
        distance: what the rays of the fans hit, m; infinite without a hit. Neighbouring zones share
            the rays of their border.
        grid: rows of zones, and zones in a row.
        steps: between the rays of a zone, along a side.
        targets: most targets of a zone.
        separation: distance between two targets, m; bodies that are nearer count as one.
    """
    rows, columns = grid
    picture = distance.reshape(len(distance), steps * rows + 1, steps * columns + 1)
    windows = np.lib.stride_tricks.sliding_window_view(picture, (steps + 1,) * 2, axis=(1, 2))
    left = windows[:, ::steps, ::steps].reshape(len(distance), rows, columns, -1)
    each = [left.min(axis=-1)]
    while len(each) < targets:
        left = np.where(left > each[-1][..., None] + separation, left, np.inf)
        each.append(left.min(axis=-1))
    return np.stack(each, axis=-1)
