"""Envelopes of the rings of a scene, and the least distance of two of them on one link."""

from collections.abc import Iterable

import numpy as np

from ...coverage.rings.clamp import Clamp, clamp_of
from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_envelope import Envelope, envelope_of, hull
from ...coverage.sensors.boards import NOMINAL, Board
from ..scene import CoreScene

_STEP = 0.035  # rad, between the tilts at which the envelope of an undecided ring is computed
_MARGIN = 0.0005  # m, by which an envelope's ends vary at most between these tilts


def clamp_in(scene: CoreScene, ring: Ring) -> Clamp:
    """Return the clamp of a ring; a sensor whose board is unknown has a nominal one."""
    board = ring.sensor.board or NOMINAL
    return _clamp(scene, ring.link, ring.radius, ring.tilt, board)


def envelope(scene: CoreScene, ring: Ring) -> Envelope:
    """Return the envelope of a ring."""
    return envelope_of(clamp_in(scene, ring), ring.tilt < 0)


def widest_envelope(scene: CoreScene, link: str, radius: float) -> Envelope:
    """Return an envelope that contains that of every ring of ``radius`` m that a search may place
    on ``link``, whatever its tilt."""
    board, (low, high) = scene.sensor_of(link).board or NOMINAL, scene.limits_of(link).tilt
    tilts = np.linspace(low, high, int((high - low) / _STEP) + 2)
    some = [
        envelope_of(_clamp(scene, link, radius, float(tilt), board), back)
        for tilt in tilts
        for back in ((False, True) if abs(tilt) < _STEP else (tilt < 0,))
    ]
    return hull(some, _MARGIN)


def _clamp(scene: CoreScene, link: str, radius: float, tilt: float, board: Board) -> Clamp:
    return clamp_of(scene.robot, link, radius, tilt, board, scene.printing)


def spacing(scene: CoreScene, proximal: Envelope, distal: Envelope) -> float:
    """Return the least distance, m, of two rings on one link, measured between their lenses."""
    if not scene.real:
        return scene.rules.spacing
    return max(scene.rules.spacing, proximal.high - distal.low + scene.rules.clearance)


def widest_spacing(scene: CoreScene, envelopes: Iterable[Envelope]) -> float:
    """Return a distance, m, that every two rings with these envelopes may have in any order."""
    some = list(envelopes)
    return max((spacing(scene, a, b) for a in some for b in some), default=scene.rules.spacing)
