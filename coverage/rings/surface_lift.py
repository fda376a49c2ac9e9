"""Sensors that lie flush in a body, lifted along their axes to its surface.

A pad of a robot skin, or a board that is glued to a housing, looks outwards from a surface. The
bodies of a robot are capsules about its links, which are a little larger, so that such a sensor
lies inside and sees nothing. Its place is then where its axis leaves the body.

Only bodies that move with the sensor decide, so that the place on the link is the same at every
pose. These bodies are convex: along the axis each is one interval, and its end is found by
bisection.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from ..robots.robot import Robot
from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedron
from .mounted_sensor import MountedSensor
from .ring import Ring, Setup
from .ring_kinematics import link_poses, seats

CLEAR = 1e-4  # m, by which a lifted sensor stands outside of all bodies
FLUSH = 1e-6  # m, a sensor this near to a body's surface counts as inside
_PRECISION = 1e-9  # m, of a body's end along an axis

Gap = Callable[[np.ndarray], float]  # signed distance of a point from a convex body, m


@dataclass(frozen=True)
class Lift:
    """A sensor that lies in a body of its own link."""

    sensor: MountedSensor
    """The sensor where it stands now."""
    body: str
    """Name of the body that it leaves last, or in which it stays."""
    distance: float
    """Distance by which it was moved along its axis, m; 0 if it stays."""

    @property
    def lifted(self) -> bool:
        """Whether it was moved; otherwise the surface is farther away than the limit."""
        return self.distance > 0


def lift_to_surface(robot: Robot, setup: Setup, limit: float) -> tuple[Setup, tuple[Lift, ...]]:
    """Return a setup whose sensors are lifted out of the bodies in which they lie.

    A sensor moves along its axis to the first place outside of all bodies that move with its link,
    if that is at most ``limit`` away; otherwise it stays. Sensors outside of these bodies stay. A
    ring of which a sensor moves becomes single sensors.

    Args:
        robot: the robot, with the bodies in use.
        setup: the setup.
        limit: largest distance, m.

    Returns:
        The setup, and the sensors that lie in a body, in the order of their numbers.

    Raises:
        ValueError: if the robot has no bodies.
    """
    if not robot.bodies:
        raise ValueError(f"robot {robot.name} has no bodies")
    rings, singles, lifts = list[Ring](), list[MountedSensor](), list[Lift]()
    for ring in setup.rings:
        each = [_lifted(robot, one, limit) for one in _singles(robot, ring)]
        lifts += [lift for lift in each if isinstance(lift, Lift)]
        if any(isinstance(lift, Lift) and lift.lifted for lift in each):
            singles += [one.sensor if isinstance(one, Lift) else one for one in each]
        else:
            rings.append(ring)
    for single in setup.singles:
        one = _lifted(robot, single, limit)
        lifts += [one] if isinstance(one, Lift) else []
        singles.append(one.sensor if isinstance(one, Lift) else one)
    return Setup(tuple(rings), tuple(singles)), tuple(lifts)


def _singles(robot: Robot, ring: Ring) -> list[MountedSensor]:
    """Return the sensors of a ring as single sensors on its link."""
    return [
        MountedSensor.from_frame(ring.link, T, ring.sensor, f"{ring.link}_{k}")
        for k, T in enumerate(link_poses(seats(robot, (ring,))[1]))
    ]


def _lifted(robot: Robot, one: MountedSensor, limit: float) -> MountedSensor | Lift:
    """Return a sensor as it is if it lies in no body of its link, else how it is lifted."""
    last, frame = len(robot.chain) - 1, robot.frame_of(one.link)
    T = one.T_link_sensor
    if frame > last:  # the TCP, which the last joint moves
        frame, T = last, robot.chain.origin[-1] @ T
    bodies = list(_bodies(robot, frame))
    start, axis = T[:3, 3], T[:3, 2]
    if not bodies or min(gap(start) for _, gap in bodies) > FLUSH:
        return one
    distance, body = _exit(bodies, start, axis, limit)
    if distance is None:
        return Lift(one, body, 0.0)
    look = np.array(one.direction) / np.linalg.norm(one.direction)
    x, y, z = (float(v) for v in np.array(one.position) + distance * look)
    moved = replace(one, position=(x, y, z), lifted=one.lifted + distance)
    return Lift(moved, body, distance)


def _bodies(robot: Robot, frame: int) -> Iterator[tuple[str, Gap]]:
    """Yield the convex bodies that move with a frame, with their signed distances in it."""
    for body in robot.bodies:
        if body.frame == frame:
            yield body.name, partial(_gap_to_capsule, body.capsule)
    for carried in robot.carried:
        if carried.frame == frame:
            yield carried.name, partial(_gap_to_polyhedron, carried.body)


def _gap_to_capsule(capsule: Capsules, point: Float[np.ndarray, " 3"]) -> float:
    return float(capsule.distance(point))


def _gap_to_polyhedron(body: Polyhedron, point: Float[np.ndarray, " 3"]) -> float:
    return float(np.asarray(body(point[None]))[0])


def _exit(
    bodies: Sequence[tuple[str, Gap]],
    start: Float[np.ndarray, " 3"],
    axis: Float[np.ndarray, " 3"],
    limit: float,
) -> tuple[float | None, str]:
    """Return the distance m along an axis to the first place outside of all bodies, and the body
    that is left there; None, and a body that holds the place at ``limit``, if it is beyond that.

    Each body is left once, because it is convex.
    """
    at, left = 0.0, ""
    while inside := [body for body in bodies if body[1](start + at * axis) < CLEAR]:
        for name, gap in inside:
            if gap(start + limit * axis) < CLEAR:
                return None, name
        at, left = max((_end(gap, start, axis, at, limit), name) for name, gap in inside)
    return at, left


def _end(
    gap: Gap,
    start: Float[np.ndarray, " 3"],
    axis: Float[np.ndarray, " 3"],
    inner: float,
    outer: float,
) -> float:
    """Return where an axis leaves a convex body, between a place inside and one outside, by
    bisection; the result is outside."""
    while outer - inner > _PRECISION:
        middle = (inner + outer) / 2
        if gap(start + middle * axis) < CLEAR:
            inner = middle
        else:
            outer = middle
    return outer
