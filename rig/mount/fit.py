"""Estimate how rings are mounted: the errors that best explain the readings, with their
uncertainty.

Rings are independent, because no ring's readings depend on another's. For each ring, first the
order of its wires is found. Then two steps alternate: least squares for the errors, over the
readings of the known cell, and the assignment of wires to seats.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ...simulation.twin.noise import USUAL_NOISE
from ..sensing.expected import CELL, ROBOT, expected
from ..sensing.readings import BLOCKED, Stops
from ..sensing.zone_targets import expected_zones
from .channel_assignment import COARSE, Order, best_order, costs, mixed, reseated
from .mounting_error_model import NAMES, both_ways, free, moved
from .ring_fit import RingFit
from .solve import MountError, Read, Solved, solve
from .zone_orders import grid_fit
from .zone_turns import ZoneTurns, nearest_zones, turn_costs, zone_turns

_FINE = 0.003  # m; the same for a fitted ring
_SEATINGS = 3  # rounds of fitting errors and assigning seats
_STILL = 6.0  # standard deviations; a sensor that varies less always reads the same
_OFTEN = 3  # stops with an expected target, after which a sensor without readings is dead
_ASTRAY = 4.0  # mean cost of a stop, above which the readings do not fit the seat


def fit_mount(
    scene: Scene,
    setup: Setup,
    stops: Stops,
    zones: Mapping[int, Stops] | None = None,
) -> tuple[RingFit, ...]:
    """Estimate how each ring of ``setup`` is mounted, from the readings at the stops of a mount
    check. A ring with too few readings has no values, and says why; the others are not concerned.

    Args:
        scene: with the known cell.
        setup: as proposed.
        stops: readings, wire by wire.
        zones: readings of the zones at the stops, by the number of their ring.
    """
    fits = []
    for i, (ring, k) in enumerate(zip(setup.rings, setup.slices, strict=False)):
        read, grids = stops.of(k), (zones or {}).get(i)
        try:
            fits.append(
                _fit(scene, ring, read) if grids is None else _fit_zones(scene, ring, read, grids)
            )
        except MountError as error:
            dead = tuple(int(wire) for wire in np.flatnonzero(read.mute))
            why = f"{error}: {_advice(scene, ring, read)}"
            fits.append(RingFit.none(ring, dead, why))
    return tuple(fits)


def _advice(scene: Scene, ring: Ring, stops: Stops) -> str:
    """Return what to do about a ring with too few readings of the cell."""
    if stops.mute.all():
        return "no sensor of it answers: check its cable, its power and its firmware"
    what = expected(scene, Setup((ring,)), stops.joints).what
    read, own, cell = np.isfinite(stops.distance).sum(), what == ROBOT, what == CELL
    places = f"of {what.size} at the stops, {read} have a distance; as proposed, {cell.sum()} meet"
    places += f" the cell and {own.sum()} the robot itself"
    if 2 * cell.sum() >= what.size:
        return f"{places}. Compare the cell in the scene with the real one, and the ring's place"
    nearer = ", nearer than the robot's own body" * bool(2 * own.sum() >= what.size)
    return (
        f"{places}. Read more stops (--stops), put a panel where this ring sees it{nearer}, and"
        " state it in the scene; or measure the ring's place by hand"
    )


def _fit_zones(scene: Scene, ring: Ring, stops: Stops, zones: Stops) -> RingFit:
    """Fit a ring of sensors with zones; without values if their grids fit no turn.

    The first returns, which do not depend on the order of the zones, then show where the ring sits
    and which sensor is which, so that the order can be named.
    """
    fit = alone = _fit(scene, ring, stops)
    if not (misfits := _misfits(scene, fit, zones)):
        fit = _fit(scene, ring, stops, zones)
        if not (misfits := _misfits(scene, fit, zones)):
            return fit
    return replace(
        alone,
        ring=ring,
        names=(),
        values=np.zeros(0),
        covariance=np.zeros((0, 0)),
        misfits=misfits,
    )


def _misfits(scene: Scene, fit: RingFit, zones: Stops) -> dict[int, str]:
    """Return what is mixed in a fitted ring's grids that fit no turn and no mirror, by wire."""
    wanted = expected_zones(scene, Setup((fit.ring,)), 0, zones.joints)[..., 0]
    wanted = wanted + fit.offset
    misfits = dict[int, str]()
    for wire in np.setdiff1d(np.arange(fit.ring.count), fit.dead):
        text = grid_fit(wanted[:, fit.seat[wire]], zones, int(wire)).misfit(wanted.shape[2])
        if text is not None:
            misfits[int(wire)] = text
    return misfits


def _fit(scene: Scene, ring: Ring, stops: Stops, zones: Stops | None = None) -> RingFit:
    """Fit a ring, with the readings of its zones if there are some."""
    joints, distance = stops.joints, stops.distance
    sigma = USUAL_NOISE.at(np.nan_to_num(distance)) * median_error(stops.valid)
    none, ways = ~np.isfinite(distance).any(axis=0), both_ways((ring,))
    tables = {
        bool(i): costs(distance, expected(scene, way, joints).distance, COARSE)
        for i, way in enumerate(ways)
    }
    by_zone = {
        bool(i): turn_costs(scene, way.rings[0], zones, joints, 0.0)[1].min(axis=0)
        for i, way in enumerate(ways)
        if zones is not None
    }
    order = best_order(by_zone or tables, np.flatnonzero(none))
    start, seat = ways[order.flipped].rings[0], order.seat(ring.count)
    mean = tables[order.flipped][np.arange(ring.count), seat] / len(joints)
    same = _still(distance, sigma)
    silent = np.flatnonzero(none | (same & (mean > _ASTRAY)))

    def in_seats(read: Read, seat: Int[np.ndarray, " n"]) -> _Seated:
        return _seated(scene, start, stops.valid, zones, read, seat, silent)

    fitted, turns = in_seats(Read(joints, distance, sigma), seat), None
    if zones is not None:
        lost = np.flatnonzero(none | stops.mute)
        turns = _turns(scene, fitted, zones, joints, order, lost)
        least, nearest = nearest_zones(scene, fitted.built, zones, joints, fitted.seat, turns)
        least = np.where(np.isfinite(distance), least, np.nan)
        # a zone's nearest ray is farther than the whole beam's nearest point, most at an edge
        whole = fitted.wanted[:, fitted.seat] - fitted.solved.values[3]
        both = np.isfinite(nearest) & np.isfinite(whole)
        apart = np.subtract(nearest, whole, out=np.zeros_like(whole), where=both)
        fitted = in_seats(Read(joints, least - apart, np.hypot(sigma, apart)), fitted.seat)
        turns = _turns(scene, fitted, zones, joints, order, lost)
    values, covariance, used, scale = fitted.solved
    seat, wanted, table = fitted.seat, fitted.wanted, fitted.table
    # a sensor that works may call what is nearer than it measures uncertain, at every stop
    near = max(BLOCKED, ring.sensor.near_m)
    index = free(scene, ring)
    often = (np.isfinite(wanted) & (wanted >= near)).sum(axis=0)[seat] >= _OFTEN
    astray = table[np.arange(ring.count), seat] / len(joints) > _ASTRAY
    dead = stops.mute | (none & often) | (same & astray)
    return RingFit(
        ring,
        fitted.built if turns is None else turns.stated_in(fitted.built),
        tuple(NAMES[k] for k in index),
        values[index],
        covariance,
        used,
        scale,
        order,
        seat,
        tuple(mixed(order, seat)),
        tuple(int(i) for i in np.flatnonzero(dead)),
        turns,
    )


class _Seated(NamedTuple):
    """Errors of a ring and the seats of its n wires."""

    solved: Solved
    """The errors."""
    built: Ring
    """The ring with these errors."""
    seat: Int[np.ndarray, " n"]
    """Seat of each wire."""
    wanted: Float[np.ndarray, "P n"]
    """Expected distances of each seat, m."""
    table: Float[np.ndarray, "n n"]
    """Cost of each wire in each seat."""


def _turns(
    scene: Scene,
    fitted: _Seated,
    zones: Stops,
    joints: Float[np.ndarray, "P J"],
    order: Order,
    silent: Int[np.ndarray, " s"],
) -> ZoneTurns:
    """Return how the zone grids of a fitted ring arrive."""
    turns, table = turn_costs(scene, fitted.built, zones, joints, float(fitted.solved.values[3]))
    return zone_turns(fitted.built, order, fitted.seat, turns, table, silent)


def _seated(
    scene: Scene,
    start: Ring,
    valid: Int[np.ndarray, "P n"],
    zones: Stops | None,
    read: Read,
    seat: Int[np.ndarray, " n"],
    silent: Int[np.ndarray, " s"],
) -> _Seated:
    """Alternate between the errors of a ring and the seats of its wires until the seats stay the
    same.

    Args:
        scene: with the known cell.
        start: the ring without errors.
        valid: number of readings of each median, by wire.
        zones: readings of its zones, by wire; None for sensors of one zone.
        read: those from which its errors are estimated.
        seat: (n,) initial seat of each wire.
        silent: wires (s,) without information.
    """
    values, wires, count = np.zeros(4), np.arange(start.count), valid[valid > 0]
    number = float(np.median(count)) if len(count) else 1.0  # typical, of a median's readings
    by_wire = np.where(np.isin(wires, silent), np.nan, read.distance)
    for _ in range(_SEATINGS):
        back = np.argsort(seat)
        solved = solve(
            scene, start, Read(read.joints, by_wire[:, back], read.sigma[:, back]), values
        )
        values, scale = solved[0], solved[3]
        built = moved(scene, start, values)
        wanted = expected(scene, Setup((built,)), read.joints).distance + values[3]
        spread = np.sqrt(
            (scale * USUAL_NOISE.at(np.where(np.isfinite(wanted), wanted, 0.0))) ** 2 / number
            + _FINE**2
        )
        table = costs(read.distance, wanted, spread)
        fine = table
        if zones is not None:
            fine = turn_costs(scene, built, zones, read.joints, values[3])[1].min(axis=0)
        again = reseated(fine, seat, silent)
        if (again == seat).all():
            break
        seat = again
    return _Seated(solved, built, seat, wanted, table)


def median_error(count: Int[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Return the standard deviation (...) of the median of ``count`` (...) standard normal numbers.

    Frames that come late leave few readings at a stop, where the limit for many, √(π / 2n), weighs
    one reading too little. Exact for one and two numbers, and within 2 % of the exact value for
    more; an even number has the smaller error, because its median is the mean of two.
    """
    n = np.maximum(count, 1)
    more = np.where(n % 2, math.pi / 2 - 1, math.pi - 2)
    error: np.ndarray = np.sqrt(math.pi / 2 / (n + more))
    return error


def _still(
    measured: Float[np.ndarray, "P n"], sigma: Float[np.ndarray, "P n"]
) -> Bool[np.ndarray, " n"]:
    """Return which wires read the same at all stops; a sensor that sees its own link does
    so too.
    """
    read = np.isfinite(measured)
    low, high = (
        f(np.where(read, measured, fill), axis=0)
        for f, fill in ((np.min, np.inf), (np.max, -np.inf))
    )
    still: np.ndarray = (read.sum(axis=0) > 2) & (high - low <= _STILL * sigma.max(axis=0))
    return still
