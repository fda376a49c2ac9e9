"""What contradicts itself in a scene, or what its robot does not allow."""

from collections.abc import Iterator
from typing import Any

from ..coverage.definitions.definition import Fault
from ..coverage.rings.mounted_sensor import BASE_LINK
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import setup_faults
from ..coverage.sensors.lids import lid_fault
from ..coverage.targets.target import Target
from .scene_keys import FIXED
from .scene_poses import pose_faults


def faults(scene: Any) -> Iterator[Fault]:
    """Yield what contradicts itself in a scene, or what its robot does not allow."""
    robot = scene.robot
    links = f"a link of {robot.name}: {', '.join(robot.links)}"
    yield from pose_faults(scene.poses, robot)
    yield from _target_faults(scene)
    for i, stop in enumerate(scene.safety.stop_times):
        if stop.joint not in robot.chain.joints:
            allowed = f"a joint of {robot.name}: {', '.join(robot.chain.joints)}"
            yield ("safety", "stop_times", i, "joint"), stop.joint, allowed
    fixed = Setup(scene.rules.fixed, scene.rules.fixed_sensors)
    yield from setup_faults(fixed, robot, scene.sensor, FIXED)
    for link in scene.mounts:
        if link not in robot.links:
            yield ("mounts", link), link, links
    for i, one in enumerate(scene.cell_sensors):
        if one.link != BASE_LINK:
            what = "a sensor on the robot belongs to a setup, or to the fixed sensors of the rules"
            allowed = f"{BASE_LINK}; {what}"
            yield ("cell_sensors", i, "link"), one.link, allowed
    without = f"because robot {robot.name} has no bodies"
    if scene.occlusion != "ignore" and not robot.bodies:
        yield ("occlusion",), scene.occlusion, f"ignore, {without}"
    if scene.real and not robot.bodies:
        yield ("rules", "mount"), "real", f"free, {without}"
    sensors = [scene.sensor, *(limits.sensor for limits in scene.mounts.values() if limits.sensor)]
    for sensor in sensors if scene.printing.cover else ():
        terms = sensor, scene.printing.clearance, scene.printing.least_wall
        if sensor.board is not None and (why := lid_fault(sensor.board, *terms)):
            yield ("printing", "cover"), True, f"false, because {why}"
            return


def _target_faults(scene: Any) -> Iterator[Fault]:
    """Yield shells within the robot's own volume, near volumes of a robot without bodies, different
    targets of one name, weights that are all 0, and a person who stands on no floor."""
    inner, first = scene.curve.robot_radius, dict[tuple[str, float | None], Target]()
    floors = (one.floor for one in scene.obstacles)
    if scene.person is not None and all(f is None for f in (scene.person.floor, *floors)):
        yield ("person", "floor"), None, "a height, m, or an obstacle with a floor"
    for i, target in enumerate(scene.targets):
        if target.reachable == "person" and scene.person is None:
            yield ("targets", i, "reachable"), "person", "true or false without a [person]"
        target, where = target.target, "radius" if target.named else "volume"
        for radius in target.radii:
            if radius <= inner:
                allowed = f"above {inner:g} m, the radius of V_R, which is no part of V_S"
                yield ("targets", i, where), radius, allowed
        if "V_N" in target.names and not scene.robot.bodies:
            allowed = f"none with V_N, because robot {scene.robot.name} has no bodies"
            yield ("targets", i, "name"), target.name, allowed
        if first.setdefault(target.key, target) != target:
            allowed = f"another name, because a different target is called {target}"
            yield ("targets", i, "name"), target.name, allowed
    if not any(target.weight > 0 for target in scene.targets):
        allowed = "above 0 for at least one target"
        yield ("targets", 0, "weight"), scene.targets[0].weight, allowed
