"""The solid of a target at a pose: its volume less the robot and the obstacles."""

import numpy as np
from jaxtyping import Float

from ..person_reach import Person, person_region
from ..reachable import reachable
from ..robots.kinematics import forward
from ..robots.link_bodies import attached_at, carried_polyhedra
from ..robots.robot import Robot
from ..robots.separation_distance import Safety
from ..solids.base import Difference, Intersection, Solid, Union
from ..solids.polyhedra import Polyhedron, half_space, polyhedra
from .own import within
from .posed_robot import PosedRobot, Shape
from .target import Target


def target_solid(
    target: Target,
    robot: Robot,
    q: Float[np.ndarray, " J"],
    shape: Shape | None = None,
    obstacles: tuple[Polyhedron, ...] = (),
    rate: Float[np.ndarray, " J"] | None = None,
    safety: Safety | None = None,
    person: Person | None = None,
) -> Difference:
    """Return the target at pose ``q`` in the base frame: the outer solid less V_R, what is attached
    to the robot, and obstacles.

    From V_N, and from all targets of which it is a part, the robot's bodies are subtracted in place
    of V_R: people get pinched between V_R's surface and the bodies'.

    Args:
        target: the target volume.
        robot: the robot; its bodies are subtracted from V_P as well.
        q: joint angles (J,), rad.
        shape: how the volume is built from the pose.
        obstacles: convex bodies to subtract, base frame.
        rate: joint speeds (J,), rad/s, for V_P; None if unknown.
        safety: terms of the separation distance, for V_P.
        person: who reaches a target that is ``reachable`` by a person.

    Raises:
        ValueError: if a shell's radius does not exceed V_R's, so that nothing is left; if
            V_P or V_N cannot be computed, as for a robot without bodies; or if a person or the
            floor is missing.
    """
    place = PosedRobot(robot, q, shape or Shape(), rate, safety or Safety())
    for radius in target.radii:
        if radius <= place.shape.robot_radius:
            raise ValueError(
                f"radius {radius:g} m of target V_S lies inside the robot's own V_R; it must"
                f" exceed {place.shape.robot_radius:g} m"
            )
    outer = target.solid(place)
    outer = within(outer, outer.bounds())
    if target.reachable == "person":
        if person is None:
            raise ValueError(
                "person: found none, allowed: one, because a target is reachable by it"
            )
        floor = person.stands_on(obstacles)
        outer = Intersection(outer, person_region(obstacles, person, floor, outer.bounds()))
        obstacles = (*obstacles, half_space(floor))
    obstacles = (*obstacles, *carried_polyhedra(robot, q))
    if target.reachable is True and obstacles:
        centres = place.curve.discs(place.shape.points_per_bend)[0]
        box = np.concatenate([outer.bounds(), centres])
        box = np.stack([box.min(axis=0), box.max(axis=0)])
        outer = Intersection(outer, reachable(obstacles, centres, box))
    if "V_N" in target.names:
        body: Solid = place.bodies
    else:
        body = place.tube(place.shape.robot_radius)
        if "V_P" in target.names:
            body = Union(body, place.protective[1])
        frames = np.asarray(forward(robot.chain, np.asarray(q, float)))
        if (capsules := attached_at(robot, frames)) is not None:
            body = Union(body, capsules)
    if obstacles:
        body = Union(body, polyhedra(obstacles, outer.bounds()))
    return Difference(outer, body)
