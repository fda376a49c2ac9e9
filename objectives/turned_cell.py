"""The cell of a scene turned by 180° about z of the base: how coordinates of a UR arm's pendant
become those of ``base_link``, exactly."""

from dataclasses import replace
from typing import Any

from ..coverage.person_reach import Person
from ..coverage.rings.mounted_sensor import BASE_LINK, MountedSensor
from ..coverage.robots.attached import Attached, ConvexSolid
from ..coverage.robots.base_frame import HALF_TURN, turned, turned_rpy
from ..coverage.solids.capsules import Capsules


def states_coordinates(scene: Any) -> bool:
    """Return whether a scene states coordinates in the base frame that half a turn changes."""
    singles, attached = scene.standing, scene.robot.attached
    return (
        any(len(obstacle.body.edges) for obstacle in scene.obstacles)
        or BASE_LINK in {*(one.link for one in singles), *(one.link for one in attached)}
        or bool(scene.person and scene.person.areas)
        or any(not goal.named or goal.importance for goal in scene.targets)
    )


def turned_fields(scene: Any) -> dict[str, Any]:
    """Return the fields of a scene with all that it states in the base frame turned: obstacles,
    volumes and weights of targets, walkable areas, sensors of the cell, and what is fixed or
    attached to the link ``base``."""
    robot = scene.robot.with_attached(tuple(map(turned_attached, scene.robot.attached)))
    fixed = tuple(map(turned_single, scene.rules.fixed_sensors))
    return {
        "robot": robot,
        "attached": robot.attached,
        "targets": tuple(goal.turned() for goal in scene.targets),
        "obstacles": tuple(map(turned_obstacle, scene.obstacles)),
        "cell_sensors": tuple(map(turned_single, scene.cell_sensors)),
        "person": None if scene.person is None else turned_person(scene.person),
        "rules": replace(scene.rules, fixed_sensors=fixed),
    }


def turned_person(person: Person) -> Person:
    """Return a person whose walkable areas are turned."""
    areas = tuple(tuple((0.0 - x, 0.0 - y) for x, y in area) for area in person.areas)
    return replace(person, areas=areas)


def turned_obstacle(obstacle: Any) -> Any:
    """Return an obstacle turned."""
    return replace(obstacle, body=_turned_solid(obstacle.body), **_turned_keys(obstacle))


def turned_single(sensor: MountedSensor) -> MountedSensor:
    """Return a single sensor turned if it is fixed to the base."""
    if sensor.link != BASE_LINK:
        return sensor
    position, direction, up = turned(sensor.position), turned(sensor.direction), turned(sensor.up)
    return replace(sensor, position=position, direction=direction, up=up)


def turned_attached(tool: Attached) -> Attached:
    """Return a solid turned if it is attached to the base."""
    if tool.link != BASE_LINK:
        return tool
    keys = _turned_keys(tool) | {"start": turned(tool.start), "end": turned(tool.end)}
    return replace(tool, solid=_turned_solid(tool.solid), **keys)


def _turned_solid(solid: Any) -> Any:
    if isinstance(solid, Capsules):
        return replace(solid, start=solid.start * HALF_TURN, end=solid.end * HALF_TURN)
    return replace(solid, normal=solid.normal * HALF_TURN, edges=solid.edges * HALF_TURN)


def _turned_keys(solid: ConvexSolid) -> dict[str, Any]:
    """Return the keys of a solid that half a turn changes: R becomes Z R Z, and points Z p."""
    points = None if solid.points is None else tuple(map(turned, solid.points))
    return {"centre": turned(solid.centre), "rpy_deg": turned_rpy(solid.rpy_deg), "points": points}
