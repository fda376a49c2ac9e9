"""Section of a report on the scene: robot, poses, targets, sensors, occlusion and mounts."""

from collections.abc import Iterator

from ...coverage.rings.sensor_records import title
from ...coverage.robots.joint_values import joint_text
from ...objectives.scene import Scene
from ..lines.occlusion import ASSUMPTIONS
from ..lines.results import calibration_lines
from ..lines.scene import record_line
from ..pages import escaped
from ..text import counted, listed
from .facts import Facts


def scene_section(f: Facts) -> Iterator[str]:
    """Yield the scene of the report, a line for each part."""
    scene, goals = f.scene, []
    weights = scene.goal_weights
    for goal, w in zip(scene.targets, weights, strict=True):
        part = f"{goal.target}" + (f", weight {w:.2f}" if len(scene.targets) > 1 else "")
        goals.append(
            part + (f", at least {100 * goal.at_least:.2f} %" if goal.at_least > 0 else "")
        )
    yield "## Scene\n"
    yield (
        f"- Robot: {escaped(scene.robot.name)}, {len(scene.robot.chain)} joints, reach"
        f" {scene.robot.reach:.2f} m."
    )
    for line in calibration_lines(f.own, f.calibration):
        yield f"- {escaped(line)}"
    yield f"- {_poses(scene)}"
    yield f"- Targets: {'; '.join(goals)}."
    yield (
        "- Sensors:"
        f" {escaped(listed([title(s) for s in dict.fromkeys(g.sensor for g in f.setup.groups)]))}."
    )
    yield f"- Occlusion: `{scene.occlusion}`, {ASSUMPTIONS[scene.occlusion]}; {_obstacles(scene)}."
    if scene.robot.attached:
        names = listed([escaped(one.name) for one in scene.robot.attached])
        yield f"- Attached to the robot: {names}."
    mounts = "with bodies, as on a real mount" if scene.real else "without bodies, as in the paper"
    yield f"- Rings: {mounts}.\n"


def _poses(scene: Scene) -> str:
    if (line := record_line(scene)) is not None:
        return f"Poses: {escaped(line)}"
    if len(scene.poses) > 1:
        return (
            f"Poses: {len(scene.poses)}; coverage is"
            f" {'that of the worst' if scene.over_poses == 'worst' else 'their weighted mean'}."
        )
    return f"Pose: {escaped(joint_text(scene.robot.chain, scene.poses[0].q))}."


def _obstacles(scene: Scene) -> str:
    names = [escaped(o.name) for o in scene.obstacles]
    return (
        f"the cell has {counted(len(names), 'obstacle')}: {', '.join(names)}"
        if names
        else "the cell has no obstacles"
    )
