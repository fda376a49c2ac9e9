"""Section of a report on the scene: robot, poses, targets, sensors, occlusion and mounts."""

from collections.abc import Iterator

from ...coverage.rings.sensor_records import title
from ...coverage.robots.joint_values import joint_text
from ...objectives.scene import Scene
from ..lines.occlusion import ASSUMPTIONS, record_line
from ..lines.results import calibration_lines
from ..pages import escaped
from ..tables import percent, target_label, target_meaning
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


SECTION = "section.png"
_CONNECTED = "is connected to the robot past the obstacles"


def definition_section(f: Facts) -> Iterator[str]:
    """Yield what coverage is, with the numbers of this setup."""
    yield "## What coverage means\n"
    yield (
        "The coverage ζ of a target is the part of its volume that at least one sensor sees, in"
        " percent: ζ = covered volume ÷ volume of the target. A point is covered if it lies in the"
        f" beam of a sensor; {ASSUMPTIONS[f.scene.occlusion]}. The volume is counted in small cubes"
        f" (voxels) of {100 * f.voxel:g} cm; a cube counts as covered if a point drawn in it is.\n"
    )
    poses = len(f.scene.poses)
    for goal, r in zip(f.scene.targets, f.own, strict=True):
        volumes = ""
        if poses == 1 and goal.target.importance is None and r.target_voxels:
            seen, whole = ((n or 0) * f.voxel**3 for n in (r.covered_voxels, r.target_voxels))
            volumes = f"{seen:.4f} m³ ÷ {whole:.4f} m³ = "
        mean = f", the mean over {poses} poses" if poses > 1 else ""
        yield f"- {target_label(r)}: ζ = {volumes}**{percent(r, r.rule)} %**{mean}"
    yield ""
    yield f"{_meaning(f.scene)}\n"
    target = f.scene.targets[0].target
    yield f"![Section through {target}: covered, uncovered, and what does not count]({SECTION})\n"
    at = " in pose 0" if len(f.scene.poses) > 1 else ""
    yield f"Vertical section through the arm{at}. ζ counts the whole volume, not this section.\n"


def _meaning(scene: Scene) -> str:
    names = [target_meaning(g.target, scene) for g in {str(g): g for g in scene.targets}.values()]
    names += [
        f"places in {g.target} count by its weight field"
        for g in scene.targets
        if g.target.importance
    ]
    names += [
        "only what "
        + ("a person can touch" if g.target.reachable == "person" else _CONNECTED)
        + f" belongs to {g.target}"
        for g in scene.targets
        if g.target.reachable
    ]
    near = {"V_N" in goal.target.names for goal in scene.targets}
    own = [f"the robot's own volume, {scene.curve.robot_radius:g} m about the curve"] * (
        False in near
    )
    own += ["the robot's bodies" + " from V_N" * bool(own)] * (True in near)
    return f"{listed(names)}; {listed(own)}, {'are' if near == {True} else 'is'} excluded."
