"""Doubtful readings of each sensor while the robot stood still: failures, missing readings,
readings below the least distance, readings that jump away from most others, and readings that do
not arrive.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ...simulation.twin.noise import USUAL_NOISE
from ..poses.near_stops import near_stops
from ..sensing.expected import expected
from ..sensing.readings import BLOCKED, FAILED, VALID, Readings, stop_of

MOST = 0.2  # share of a sensor's readings, above which a kind of doubt counts
_FEWEST = 3  # doubtful readings
_BODY = 0.05  # m between a body and its model
_SURE = 5.0  # standard deviations
# width of a cluster of distances: m at least, and standard deviations
_WIDTH, _WIDE = 0.06, 6.0
_EDGE = 0.9  # of the range; a target beyond may be missed
KINDS = ("failed", "missing", "near", "apart", "absent", "together")


@dataclass(frozen=True)
class Doubt:
    """Doubtful readings of K sensors, as wired."""

    readings: Int[np.ndarray, " K"]
    """Number of readings."""
    shares: Float[np.ndarray, "6 K"]
    """Share of the readings that are doubtful, by ``KINDS``: failures, 1 without readings; without
    a sure distance at stops with a target; below the sensor's least distance, or 5 cm, where
    nothing is expected; outside the cluster that most distances are in. Of the frames of its ring,
    in which it sends nothing; in which it fails, misses, reads too near or sends nothing."""

    @property
    def found(self) -> Bool[np.ndarray, "6 K"]:
        """Which of ``KINDS`` counts for which sensor; ``together`` if no other one does."""
        absent = self.shares[KINDS.index("absent")]
        frames = self.readings / np.where(absent < 1, 1 - absent, 1.0)
        enough = (self.readings == 0) | (np.rint(self.shares * frames) >= _FEWEST)
        found = np.asarray((self.shares > MOST) & enough)
        found[-1] &= ~found[:-1].any(axis=0)
        return found

    def worse(self, other: "Doubt") -> "Doubt":
        """Return the larger shares of two parts of a check."""
        both = np.maximum(self.shares, other.shares)
        return Doubt(np.maximum(self.readings, other.readings), both)


def doubt(
    scene: Scene,
    setup: Setup,
    readings: Readings,
    joints: Float[np.ndarray, "P J"],
) -> Doubt:
    """Count the doubtful readings of each sensor over stops of the robot.

    A reading is missing where the sensor reads a target in more than a fifth of the others, or
    should see one and sometimes does. A target in the last tenth of the range may be missed. A body
    that should be close to a sensor explains near and missing readings. Near readings that all
    others at the stop agree with are also explained by the robot's own body, however the ring is
    wired and mounted.

    Args:
        scene: with the known cell.
        setup: the rings as proposed.
        readings: while the robot stood still.
        joints: (P, J) rad, the stops.

    Raises:
        ValueError: if a reading is of a sensor that the setup does not have.
    """
    shape = (len(joints), setup.sensors)
    stop, wire = stop_of(readings, joints), readings.wire(setup)
    group = np.where(stop >= 0, stop * setup.sensors + wire, -1)
    sensors = [g.sensor for g in setup.groups for _ in range(g.count)]
    least = np.array([max(BLOCKED, s.near_m) for s in sensors])
    most = np.array([s.range_m for s in sensors])
    seen = np.isfinite(readings.distance)
    valid = seen & (readings.status == VALID)
    below = seen & (readings.distance < least[wire])

    def number(some: np.ndarray) -> Int[np.ndarray, "P K"]:
        return np.bincount(group[some & (group >= 0)], minlength=shape[0] * shape[1]).reshape(shape)

    total, read, failed = number(group >= 0), number(valid), number(readings.status == FAILED)
    wanted = expected(scene, setup, joints).distance
    there = np.isfinite(wanted)
    close = there & (wanted <= least + _BODY + _SURE * USUAL_NOISE.at(np.where(there, wanted, 0.0)))
    here = valid & (group >= 0)
    middle, apart = _clusters(readings.distance[here], group[here], total)
    with np.errstate(invalid="ignore"):
        edge = (wanted >= _EDGE * most) & there | (middle >= _EDGE * most)
    sees = (read > MOST * total) | ((read > 0) & there)
    missing = np.where(sees & ~close & ~edge, total - read - failed - number(below & ~valid), 0)
    near = np.where(close, 0, number(below))
    near = np.where(_own_body(scene, setup, joints, near, least), np.minimum(near, apart), near)
    readings_of = total.sum(axis=0)
    none, every = readings_of == 0, np.maximum(readings_of, 1)
    doubtful = [a.sum(axis=0) for a in (failed, missing, near, apart)]
    sent = [total[:, k].max(axis=1).sum() for k in setup.slices]
    frames = np.maximum(np.array(sent)[setup.ring_of_sensor], 1)
    absent = np.where(none, 0, frames - readings_of)
    together = sum(doubtful[:3]) + absent
    shares = np.stack([*(a / every for a in doubtful), absent / frames, together / frames])
    shares[np.ix_((0, 5), none)] = 1.0
    return Doubt(readings_of, shares)


def _own_body(
    scene: Scene,
    setup: Setup,
    joints: Float[np.ndarray, "P J"],
    near: Int[np.ndarray, "P K"],
    least: Float[np.ndarray, " K"],
) -> Bool[np.ndarray, "P K"]:
    """Return where the robot's own body may be closer than ``least`` m to a sensor that reads
    so."""
    found, some = np.zeros(near.shape, bool), near.any(axis=1)
    if some.any():
        full = max(float(least.max()), scene.motion.near)
        wary = replace(scene, motion=replace(scene.motion, near=full, rings_as_proposed=False))
        stops = near_stops(wary, setup, joints[some]).wired_anyhow(setup)
        found[some] = (stops.least < least) & (stops.least < full)
    return found


def _clusters(
    distance: Float[np.ndarray, " n"],
    group: Int[np.ndarray, " n"],
    total: Int[np.ndarray, "P K"],
) -> tuple[Float[np.ndarray, "P K"], Int[np.ndarray, "P K"]]:
    """Return the median of the distances of each group, m, nan for an empty one; and the number of
    distances outside the narrow cluster that most are in.
    """
    middle, apart = np.full(total.size, np.nan), np.zeros(total.size, int)
    order = np.lexsort((distance, group))
    first = np.searchsorted(group[order], np.arange(total.size + 1))
    for i in np.flatnonzero(np.diff(first)):
        here = distance[order[first[i] : first[i + 1]]]
        middle[i] = np.median(here)
        width = max(_WIDTH, _WIDE * float(USUAL_NOISE.at(middle[i : i + 1])[0]))
        inside = np.searchsorted(here, here + width, side="right") - np.arange(len(here))
        apart[i] = len(here) - inside.max()
    return middle.reshape(total.shape), apart.reshape(total.shape)
