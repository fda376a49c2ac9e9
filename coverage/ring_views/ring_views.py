"""How many sensors of a ring see each point, for many places of the ring at once.

Consider a point at radius r and height z above the ring's plane, and a sensor at radius R, tilted
by t out of that plane, whose azimuth differs from the point's by d. With c = cos d, the vector v
from the sensor to the point has the component cos t (r c - R) + z sin t along the sensor's axis and
the squared length |v|^2 = r^2 - 2 r R c + R^2 + z^2.

The component grows with c, because cos t is never negative, and the length decreases. If a cone
with a half angle of at most a right angle contains the point at some c, it contains it at every
greater c too, as long as the range suffices. Hence a point outside the endless cone about the beam
of the sensor nearest in azimuth is outside those of all sensors of the ring. One test of each place
and point (dense) leaves few candidates. Only for these are beams, mounting errors and lines of
sight tested exactly, sensor by sensor in the order of their azimuths, until one lies outside.

A test piece, or a ball about a point, reaches into beams that its centre is outside of. The outer
cone is then wider by a distance at every depth: the distance of the point from the sensor's axis
falls as c grows, so that the same holds.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8, UInt16

from ..detection.aspect import Vertical
from ..rings.mounting_errors import seated
from ..rings.ring import Ring
from ..solids.beams import InBeam
from .balls import STEPS, met_balls
from .detections import MOST, Detections, SensorDetections
from .line_of_sight import LinkOccluders
from .mount_points import MountPoints, RingErrors
from .reaching import WIDEST, Reaching
from .sightlines import Sightlines

_MARGIN = 1e-3  # rad, by which outer cones exceed the beams in them


class RingPlaces(NamedTuple):
    """K places of a ring."""

    height: Float[np.ndarray, " K"]
    """Heights from the mount's start, m."""
    tilt: Float[np.ndarray, " K"]
    """Tilts, rad."""
    phase: Float[np.ndarray, " K"]
    """Phases, rad."""


class Views(NamedTuple):
    """What a ring sees at K places."""

    counts: UInt8[np.ndarray, "K N"]
    """Number of sensors that see each point, at most the requested number, or the integers of
    ``detections``."""
    sensor: UInt16[np.ndarray, "K N"] | None
    """Number on the ring of the last counted sensor; None if not requested."""


class _Relative(NamedTuple):
    """Points in coordinates about the ring's axis, (K, N) or (N,)."""

    x: np.ndarray
    y: np.ndarray
    radius: np.ndarray
    above: np.ndarray
    azimuth: np.ndarray
    """From the ring's phase, rad; x and y are from the mount's zero direction."""

    def at(self, kn: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return x, y and the height above the ring's plane of pairs of a place and a point."""
        which = n if self.x.ndim == 1 else kn
        return self.x.take(which), self.y.take(which), self.above.take(kn)


def ring_views(
    ring: Ring,
    points: MountPoints,
    places: RingPlaces,
    most: int = 1,
    past: LinkOccluders | None = None,
    errors: RingErrors | None = None,
    named: bool = False,
    detections: Detections | None = None,
) -> Views:
    """Return how many sensors of a ring see each point, for K places of the ring.

    Where points have balls, sensors count whose beam meets the ball and that see the point of the
    beam nearest to its centre.

    With 32 bits, a point within about 1e-6 m of a beam's surface may fall on either side.

    Args:
        ring: gives sensor, count and radius.
        points: N points in the coordinates of the ring's mount.
        places: the places.
        most: sensors to count at a point, at least 1.
        past: occluders in the coordinates of the mount; None: nothing occludes.
        errors: mounting errors; None: perfect mounting.
        named: whether to return which sensor sees a point.
        detections: what is to be detected at the points; None: sensors that see them are counted.
    """
    places = RingPlaces(*(np.asarray(a, np.float32) for a in places))
    outer = ring.sensor.outer_angle + (errors.widest if errors else 0.0)
    wide = bool(points.ball.any())
    exact = ring.sensor.plain and past is None and errors is None and detections is None
    exact = exact and not wide
    around = _relative(points, places, errors)
    spacing = np.float32(2 * math.pi / ring.count)
    turns = around.azimuth * (1 / spacing)
    turns -= np.rint(turns)
    turns *= spacing
    by = None if detections is None else detections.by(ring.sensor)
    outer = outer if exact else outer + _MARGIN
    reaching = None if by is None else Reaching.of_piece(by)
    if wide:
        reaching = Reaching.of_balls(ring.sensor, points.ball, outer)
    near = _Nearest(ring, around, places, turns, outer, reaching)
    part, inside = near.all()
    count = np.zeros(inside.shape, np.uint8)
    sensor = np.zeros(inside.shape, np.uint16) if named else None
    if exact and not named:
        np.less_equal(part, np.float32(ring.sensor.range_m), out=count.view(bool))
        count &= inside.view(np.uint8)
        if most == 1:
            inside &= count == 0
    kn = np.flatnonzero(inside)
    if len(kn):
        tests = _Tests(ring, points, places, past, errors, by)
        near.sparse(kn, count, sensor, most, tests, int(exact and not named))
    return Views(count, sensor)


def _relative(points: MountPoints, places: RingPlaces, errors: RingErrors | None) -> _Relative:
    height, phase = places.height[:, None], places.phase[:, None]
    if errors is None:
        above, azimuth = points.height - height, points.azimuth - phase
        return _Relative(points.x, points.y, points.radius, above, azimuth)
    turn, z = errors.rotation[points.mounting], points.height - errors.slip[points.mounting]
    x, y, above = (
        turn[:, 0, i] * points.x + turn[:, 1, i] * points.y + turn[:, 2, i] * z - height * t
        for i, t in ((i, turn[:, 2, i]) for i in range(3))
    )
    azimuth = np.arctan2(y, x)
    azimuth -= phase
    return _Relative(x, y, np.sqrt(x * x + y * y), above, azimuth)


class _Nearest:
    """The sensors of a ring in the order of their distance in azimuth from each point."""

    def __init__(
        self,
        ring: Ring,
        around: _Relative,
        places: RingPlaces,
        turns: np.ndarray,
        outer: float,
        reaching: Reaching | None,
    ) -> None:
        """Use the azimuths ``turns`` (K, N), rad, from the nearest sensor to each point."""
        self._ring, self._around, self._turns = ring, around, turns
        self._cos, self._sin = np.cos(places.tilt), np.sin(places.tilt)
        direction = _directions(places, ring.count)  # (K, J)
        self._east, self._north = (
            f(direction).astype(np.float32).ravel() for f in (np.cos, np.sin)
        )
        self._all = outer > math.pi / 2 + 2 * _MARGIN
        self._square = np.float32(math.cos(min(outer, math.pi / 2)) ** 2)
        self._tangent = np.float32(math.tan(min(outer, WIDEST)))
        self._reaching = reaching

    def _inside(
        self, part: np.ndarray, square: np.ndarray, reaching: Reaching | None
    ) -> np.ndarray:
        """Return which points lie in the endless outer cone, or what is there may reach into it."""
        if reaching is not None:
            edge = np.maximum(part, 0) * self._tangent
            edge += reaching.beyond
            within: np.ndarray = square <= part * part + edge * edge
            within &= part >= -reaching.beyond
            within &= square <= reaching.reach * reaching.reach
            return within
        if self._all:
            return np.ones(part.shape, bool)
        square *= self._square
        inside: np.ndarray = part * part >= square
        inside &= part > 0
        return inside

    def all(self) -> tuple[Float[np.ndarray, "K N"], Bool[np.ndarray, "K N"]]:
        """Return the component of each point along the axis of the sensor nearest to it, m, and
        whether it lies in that sensor's outer cone."""
        radius, above, R = self._around.radius, self._around.above, np.float32(self._ring.radius)
        part = np.cos(self._turns)
        part *= radius
        square = above * above
        square += radius * radius + R * R
        square -= 2 * R * part
        part -= R
        part *= self._cos[:, None]
        part += above * self._sin[:, None]
        return part, self._inside(part, square, self._reaching)

    def sparse(
        self,
        kn: Int[np.ndarray, " T"],
        count: UInt8[np.ndarray, "K N"],
        sensor: UInt16[np.ndarray, "K N"] | None,
        most: int,
        tests: "_Tests",
        first: int,
    ) -> None:
        """Count the sensors that see points, up to ``most``, from the sensor of rank ``first`` on.

        Args:
            kn: flat indices of the pairs of a place and a point; ``take`` needs a fraction of the
                time of two indices.
            count, sensor: what is counted.
            most: sensors to count at a point.
            tests: the exact tests.
            first: rank of the first sensor, by its distance in azimuth.
        """
        sensors, spacing = self._ring.count, np.float32(2 * math.pi / self._ring.count)
        R = np.float32(self._ring.radius)
        k, n = np.divmod(kn, count.shape[1])
        turn = self._turns.take(kn)
        nearest = np.rint((self._around.azimuth.take(kn) - turn) / spacing).astype(np.int32)
        nearest %= sensors
        ahead = np.where(turn >= 0, np.int32(1), np.int32(-1))
        for rank in range(first, sensors):
            number = nearest + ahead * ((rank + 1) // 2 if rank % 2 else -(rank // 2))
            number += sensors * (number < 0)
            number -= sensors * (number >= sensors)
            which = k * sensors + number
            east, north = self._east.take(which), self._north.take(which)
            x, y, above = self._around.at(kn, n)
            radial, across = x * east + y * north - R, y * east - x * north
            cos, sin = self._cos.take(k), self._sin.take(k)
            part = radial * cos + above * sin
            up = above * cos - radial * sin
            if rank:
                square = radial * radial + across * across + above * above
                reaching = None if self._reaching is None else self._reaching.some(n)
                kept = np.flatnonzero(self._inside(part, square, reaching))
                if not len(kept):
                    return
                if len(kept) < len(k):
                    kn, k, n, nearest, ahead, number, part, across, up = (
                        a.take(kept) for a in (kn, k, n, nearest, ahead, number, part, across, up)
                    )
            seen, worth = tests.see(k, n, number, part, across, up)
            _add(count.ravel(), kn.take(seen), worth)
            if sensor is not None:
                sensor.ravel()[kn.take(seen)] = number.take(seen)
            if rank == sensors - 1:
                return
            go = np.flatnonzero(count.take(kn) < most)
            if len(go) < len(k):
                kn, k, n, nearest, ahead = (a.take(go) for a in (kn, k, n, nearest, ahead))


class _Tests:
    """Exact tests of single sensors and points."""

    def __init__(
        self,
        ring: Ring,
        points: MountPoints,
        places: RingPlaces,
        past: LinkOccluders | None,
        errors: RingErrors | None,
        detections: SensorDetections | None,
    ) -> None:
        self._sensor, self._points, self._errors = ring.sensor, points, errors
        self._detections, self._balls = detections, bool(points.ball.any())
        self._shape = (len(places.height), ring.count)  # places, sensors
        self._turn, self._tilt = _directions(places, ring.count).ravel(), places.tilt
        self._past: Sightlines | None = None
        if past is not None:
            apex, look = _sensor_poses(ring, places, errors)
            self._past = Sightlines(past, apex, look, ring.sensor)

    def see(
        self,
        k: Int[np.ndarray, " T"],
        n: Int[np.ndarray, " T"],
        number: Int[np.ndarray, " T"],
        along: Float[np.ndarray, " T"],
        across: Float[np.ndarray, " T"],
        up: Float[np.ndarray, " T"],
    ) -> tuple[Int[np.ndarray, " S"], UInt8[np.ndarray, " S"] | None]:
        """Return the indices of the pairs in which sensor ``number`` at place ``k`` sees the point
        ``n``, whose coordinates from the intended sensor are the last three, and what they count;
        None: 1."""
        mounting: int | np.ndarray = 0
        if self._errors is not None:
            mounting = self._points.mounting.take(n)
            seat = np.moveaxis(self._errors.seat[mounting, number], -1, 0)
            along, across, up = seated(seat, along, across, up)
        at, worth, moved = InBeam(along, across, up), None, None
        if self._balls:
            return self._meet(at, k, n, number), None
        if self._detections is None:
            seen: np.ndarray = np.flatnonzero(self._sensor.holds(at))
        else:
            counts, step = self._detections.counts(at, self._vertical(k, n, number))
            seen = np.flatnonzero(counts)
            upwards = self._points.vertical.take(n.take(seen), axis=0)
            worth, moved = counts[seen], step[seen, None] * upwards
        if self._past is not None:
            k, n, number = (a.take(seen) for a in (k, n, number))
            clear = self._clear(k, n, number, moved)
            seen, worth = seen[clear], None if worth is None else worth[clear]
        return seen, worth

    def _clear(
        self,
        k: Int[np.ndarray, " T"],
        n: Int[np.ndarray, " T"],
        number: Int[np.ndarray, " T"],
        moved: Float[np.ndarray, "T 3"] | None,
    ) -> Bool[np.ndarray, " T"]:
        """Return in which pairs nothing hides the point, or the one ``moved`` m from it."""
        if self._past is None:
            return np.ones(len(k), bool)
        mounting = 0 if self._errors is None else self._points.mounting.take(n)
        places, sensors = self._shape
        which = (mounting * places + k) * sensors + number
        return self._past.clear(which, self._points, n, moved)

    def _meet(
        self,
        at: InBeam,
        k: Int[np.ndarray, " T"],
        n: Int[np.ndarray, " T"],
        number: Int[np.ndarray, " T"],
    ) -> Int[np.ndarray, " S"]:
        """Return the indices of the pairs in which the sensor sees a part of the ball about the
        point; see ``balls``."""
        ball, seen = self._points.ball.take(n), np.zeros(len(n), bool)
        some = np.arange(len(n))
        for step in STEPS if self._past is not None else STEPS[:1]:
            there = InBeam(*(a.take(some) for a in (at.along, at.across, at.up)))
            met, moved = met_balls(self._sensor, there, ball.take(some), step)
            pairs = some[met]
            at_k, at_n, at_number = (a.take(pairs) for a in (k, n, number))
            moved = self._in_mount(at_k, at_number, moved[met])
            seen[pairs[self._clear(at_k, at_n, at_number, moved)]] = True
            some = np.flatnonzero(~seen & (ball > 0))
            if not len(some):
                break
        return np.flatnonzero(seen)

    def _in_mount(
        self, k: Int[np.ndarray, " T"], number: Int[np.ndarray, " T"], way: Float[np.ndarray, "T 3"]
    ) -> Float[np.ndarray, "T 3"]:
        """Return ways in the frames of the sensors as intended in the coordinates of the mount."""
        turn, tilt = self._turn.take(k * self._shape[1] + number), self._tilt.take(k)
        (along, across, up), cos, sin = way.T, np.cos(turn), np.sin(turn)
        ahead, aside = np.cos(tilt), np.sin(tilt)
        radial, z = along * ahead - up * aside, along * aside + up * ahead
        there = radial * cos - across * sin, radial * sin + across * cos, z
        return np.stack(there, axis=1).astype(np.float32)

    def _vertical(
        self, k: Int[np.ndarray, " T"], n: Int[np.ndarray, " T"], number: Int[np.ndarray, " T"]
    ) -> Vertical:
        """Return the vertical in the frames of the sensors as intended."""
        turn, tilt = self._turn.take(k * self._shape[1] + number), self._tilt.take(k)
        x, y, z = self._points.vertical.take(n, axis=0).T
        cos, sin = np.cos(turn), np.sin(turn)
        radial, ahead, aside = x * cos + y * sin, np.cos(tilt), np.sin(tilt)
        return Vertical(radial * ahead + z * aside, y * cos - x * sin, z * ahead - radial * aside)


def _add(
    count: UInt8[np.ndarray, " N"],
    index: Int[np.ndarray, " S"],
    worth: UInt8[np.ndarray, " S"] | None,
) -> None:
    """Add 1, or other numbers up to the largest of 8 bits, to counts at different indices."""
    if worth is None:
        count[index] += 1
    else:
        before = count[index]
        count[index] = before + np.minimum(worth, MOST - before)


def _directions(places: RingPlaces, count: int) -> Float[np.ndarray, "K J"]:
    """Return the azimuths of all sensors at all places, rad."""
    turn: np.ndarray = places.phase[:, None] + np.arange(count) * (2 * math.pi / count)
    return turn


def _sensor_poses(
    ring: Ring, places: RingPlaces, errors: RingErrors | None
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 3"]]:
    """Return apexes, m, and axes of all sensors at all places, in the coordinates of the mount, for
    each mounting: S = mountings * places * sensors."""
    turn = _directions(places, ring.count)  # (K, J)
    cos, sin, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
    ct, st = np.cos(places.tilt)[:, None], np.sin(places.tilt)[:, None]
    radial = np.stack([cos, sin, zero], axis=-1)[None]  # (1, K, J, 3)
    look = np.stack([ct * cos, ct * sin, st + zero], axis=-1)[None]
    seat, height = ring.radius * radial, places.height[None, :, None]
    if errors is not None:
        up = np.stack([-st * cos, -st * sin, ct + zero], axis=-1)[None]
        along = np.stack([-sin, cos, zero], axis=-1)[None]
        straight, raised, aside = (
            errors.seat[:, None, : ring.count, i, None] for i in range(3)
        )  # (D, 1, J, 1)
        look = straight * look + raised * up + aside * along
        rotation = errors.rotation[:, None].swapaxes(-1, -2)  # (D, 1, 3, 3)
        seat, look = seat @ rotation, look @ rotation
        height = height + errors.slip[:, None, None]
    apex = seat.astype(np.float32)
    apex[..., 2] += height
    return apex.reshape(-1, 3), look.astype(np.float32).reshape(-1, 3)
