"""Envelopes of the rings of a scene, and the least distance of two of them on one link."""

from functools import lru_cache

import numpy as np

from ...coverage.rings.clamp import clamp_of
from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_envelope import Envelope, envelope_of, hull
from ...coverage.robots.ring_section import surrounded
from ...coverage.robots.robot import Mount
from ...coverage.sensors.board_packing import Printing
from ...coverage.sensors.boards import NOMINAL, Board
from ..link_segments import TILTS
from ..scene import Scene

_STEP = 0.0175  # rad, between the tilts at which the envelope of an undecided ring is computed
_MARGIN = 0.00025  # m, by which an envelope's ends vary at most between these tilts
_LEVEL = 1e-6  # rad, of a ring whose beams may lean to either side


def envelope(scene: Scene, ring: Ring) -> Envelope:
    """Return the envelope of a ring; a sensor whose board is unknown has a nominal one."""
    around, board = surrounded(scene.robot, ring.link), ring.sensor.board or NOMINAL
    clamp = clamp_of(around, ring.radius, ring.tilt, board, scene.printing)
    return envelope_of(clamp, ring.tilt < 0)


def envelopes_by_tilt(scene: Scene, link: str, radius: float) -> list[Envelope]:
    """Return, for each of ``TILTS``, an envelope that contains that of every ring of ``radius`` m
    that a search may place on ``link`` with a tilt up to the neighbours in ``TILTS``."""
    board, (low, high) = scene.sensor_of(link).board or NOMINAL, scene.limits_of(link).tilt
    around = surrounded(scene.robot, link)
    return [*_by_tilt(around, radius, low, high, board, scene.printing)]


@lru_cache(maxsize=256)  # a scene is often stated anew, and with it the same rings
def _by_tilt(
    around: float, radius: float, low: float, high: float, board: Board, printing: Printing
) -> tuple[Envelope, ...]:
    """Return the envelopes of ``envelopes_by_tilt`` between the lowest and the highest tilt, rad,
    around a tube of radius ``around``, m."""
    tilts = np.linspace(low, high, int((high - low) / _STEP) + 2)
    ahead = [envelope_of(clamp_of(around, radius, float(tilt), board, printing)) for tilt in tilts]
    back = [e.flipped for e in ahead]
    reach, each = float(TILTS[1] - TILTS[0]) + _STEP, list[Envelope]()
    for tilt in np.clip(TILTS, low, high):
        near = np.flatnonzero(np.abs(tilt - tilts) <= reach)
        backwards, forwards = tilt < _LEVEL, tilt > -_LEVEL
        some = [back[i] for i in near if backwards] + [ahead[i] for i in near if forwards]
        each.append(hull(some, _MARGIN))
    return tuple(each)


def closable(mount: Mount, around: Envelope) -> tuple[float, float]:
    """Return the lowest and highest position at which a ring with this envelope can be closed.

    The whole ring must lie in the usable part. If there is no such position, the first value
    exceeds the second. A mount without length has the one position 0.
    """
    if mount.length == 0:
        return 0.0, 0.0
    low, high = mount.usable
    return low - around.low / mount.length, high - around.high / mount.length


def spacing(scene: Scene, proximal: Envelope, distal: Envelope) -> float:
    """Return the least distance, m, of two rings on one link, measured between their lenses."""
    if not scene.real:
        return scene.rules.spacing
    return max(scene.rules.spacing, proximal.high - distal.low + scene.rules.clearance)
