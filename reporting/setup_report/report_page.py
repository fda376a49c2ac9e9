"""Report of a setup as Markdown."""

import shlex
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

from ...coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from ...coverage.robots.joint_values import joint_text
from ...formats.schema.sensor_records import sensor_records, title
from ...objectives.scene import CoreScene
from ..detection_page import DISCLAIMER
from ..lines.calibration import calibration_lines
from ..lines.motion import record_line
from ..lines.occlusion import ADVICE, scene_lines, unseeing_lines
from ..lines.protective_volume import protective_lines
from ..lines.sensors import sensor_lines
from ..lines.targets import described
from ..pages import code, command, escaped, table
from ..robustness import lines, robustness_rows
from ..tables import count_error_line, target_label
from ..text import counted, listed
from .bill_of_materials import materials
from .blind_spot_section import blind_spot_section
from .cable_section import cable_section
from .cover import Identity, cover
from .facts import Facts
from .mounting_guide import mounting

SECTION = "section.png"
# options of the report that verify does not take, and flags without a value
_ASKED = (
    "--target",
    "--radius",
    "--draws",
    "--seed",
    "--voxel",
    "--out",
    "--require",
    "--revision",
)
_FLAGS = ("--pdf", "--json")
_UNDER = {
    "ignore": "beams pass through the robot, as in the paper",
    "shadow": "points behind the body are not covered, as for multi-zone sensors",
    "blind": "the body blocks any sensor whose beam it enters, as for one-zone sensors",
}
_DISTANT = {
    "blind": "under `blind`",
    "shadow": "under `shadow`",
    "ignore": "under `ignore`",
}


def page(
    f: Facts,
    words: Sequence[str],
    versions: Mapping[str, str],
    identity: Identity,
    frame_length: Callable[[int], int],
) -> str:
    """Return the whole report.

    Args:
        f: counts of the setup.
        words: words of the command line.
        versions: versions of the programs.
        identity: what tells the report from others.
        frame_length: returns the bytes that a ring with a given number of sensors sends at once.
    """
    parts = (
        cover(f, identity, answer(f), versions["place-rings"]),
        _definition(f),
        _scene(f),
        blind_spot_section(f),
        _coverage(f),
        _separation(f),
        _robust(f),
    )
    lines = [line for part in parts for line in part]
    lines += ["## Mounting", "", *mounting(f.scene, f.setup), *_faults(f)]
    lines += cable_section(f.scene, f.setup)
    lines += [
        "## Bill of materials",
        "",
        *materials(f.scene, f.setup, frame_length),
        *_effective(f),
    ]
    lines += [*_reproduce(f, words, versions), *_limits(f)]
    return "\n".join(lines) + "\n"


def answer(f: Facts) -> str:
    """Return the coverage of the setup in one sentence."""
    what = f"{counted(f.setup.sensors, 'sensor')} on {counted(len(f.setup.rings), 'ring')}"
    if f.setup.singles:
        what += f" and as {counted(len(f.setup.singles), 'single sensor')}"
    if f.scene.cell_sensors:
        what += f" with {counted(len(f.scene.cell_sensors), 'sensor')} of the cell"
    each = []
    for r in f.own:
        others = [m for m in OCCLUSIONS if m != f.scene.occlusion and m in r.by_occlusion_percent]
        beyond = ", ".join(f"{r.by_occlusion_percent[m]:.2f} % {_DISTANT[m]}" for m in others)
        each.append(
            f"**{r.zeta_percent:.2f} % of {target_label(r)}**" + (f" ({beyond})" if beyond else "")
        )
    return f"{what} cover {listed(each)}."


def _definition(f: Facts) -> Iterator[str]:
    """Yield what coverage is, with the numbers of this setup."""
    yield "## What coverage means\n"
    yield (
        "The coverage ζ of a target is the part of its volume that at least one sensor sees, in"
        " percent: ζ = covered volume ÷ volume of the target. A point is covered if it lies in the"
        f" beam of a sensor; {_UNDER[f.scene.occlusion]}. The volume is counted in small cubes"
        f" (voxels) of {100 * f.voxel:g} cm; a cube counts as covered if its centre is.\n"
    )
    poses = len(f.scene.poses)
    for goal, r in zip(f.scene.goals, f.own, strict=True):
        volumes = ""
        if poses == 1 and goal.target.importance is None and r.target_voxels:
            seen, whole = ((n or 0) * f.voxel**3 for n in (r.covered_voxels, r.target_voxels))
            volumes = f"{seen:.4f} m³ ÷ {whole:.4f} m³ = "
        mean = f", the mean over {poses} poses" if poses > 1 else ""
        yield f"- {target_label(r)}: ζ = {volumes}**{r.zeta_percent:.2f} %**{mean}"
    yield ""
    yield f"{_meaning(f.scene)}\n"
    target = f.scene.goals[0].target
    yield f"![Section through {target}: covered, uncovered, and what does not count]({SECTION})\n"
    at = " in pose 0" if len(f.scene.poses) > 1 else ""
    yield f"Vertical section through the arm{at}. ζ counts the whole volume, not this section.\n"


def _scene(f: Facts) -> Iterator[str]:
    scene, goals = f.scene, []
    weights = scene.goal_weights
    for goal, w in zip(scene.goals, weights, strict=True):
        part = f"{goal.target}" + (f", weight {w:.2f}" if len(scene.goals) > 1 else "")
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
    yield f"- Occlusion: `{scene.occlusion}`, {_UNDER[scene.occlusion]}; {_obstacles(scene)}."
    if scene.robot.attached:
        names = listed([escaped(one.name) for one in scene.robot.attached])
        yield f"- Attached to the robot: {names}."
    mounts = "with bodies, as on a real mount" if scene.real else "without bodies, as in the paper"
    yield f"- Rings: {mounts}.\n"


def _poses(scene: CoreScene) -> str:
    if (line := record_line(scene)) is not None:
        return f"Poses: {escaped(line)}"
    if len(scene.poses) > 1:
        return (
            f"Poses: {len(scene.poses)}; coverage is"
            f" {'that of the worst' if scene.over_poses == 'worst' else 'their weighted mean'}."
        )
    return f"Pose: {escaped(joint_text(scene.robot.chain, scene.poses[0].q))}."


def _meaning(scene: CoreScene) -> str:
    words = {
        "V_O": f"V_O is the ball of {scene.robot.reach:g} m about the arm's base",
        "V_T": f"V_T is the ball of {scene.shape.tcp_range:g} m about the tool",
        "V_OT": "V_OT is the union of the balls about base and tool",
        "V_S": "V_S(r) is the shell of all points within r m of the robot's curve",
        "V_P": "V_P is the space within the separation distance of a part of the robot",
    }
    names = [
        words.get(g.target.name) or f"{g.target} is {described(g.target)}"
        for g in {g.target.name: g for g in scene.goals}.values()
    ]
    names += [
        f"places in {g.target} count by its weight field"
        for g in scene.goals
        if g.target.importance
    ]
    names += [
        f"only what is connected to the robot past the obstacles belongs to {g.target}"
        for g in scene.goals
        if g.target.reachable
    ]
    return (
        f"{listed(names)}; the robot's own volume, {scene.shape.robot_radius:g} m about the"
        " curve, is excluded."
    )


def _obstacles(scene: CoreScene) -> str:
    names = [escaped(o.name) for o in scene.obstacles]
    return (
        f"the cell has {counted(len(names), 'obstacle')}: {', '.join(names)}"
        if names
        else "the cell has no obstacles"
    )


def _coverage(f: Facts) -> Iterator[str]:
    yield "## Coverage\n"
    many = f", the mean over {len(f.scene.poses)} poses" if len(f.scene.poses) > 1 else ""
    yield (
        f"ζ, the covered share of each target, in percent{many}, counted by rule `centre` with"
        f" voxels of {f.voxel:g} m;"
    )
    error = count_error_line(f.voxel)
    yield f"the paper's layouts use this scene's sensor. {error or ''}".rstrip() + "\n"
    labels = list(dict.fromkeys(target_label(r) for r in f.zetas))
    models: list[Occlusion] = [
        m for m in OCCLUSIONS if any(m in r.by_occlusion_percent for r in f.zetas)
    ]
    models.sort(key=lambda model: model != f.scene.occlusion)
    for model in models or [f.scene.occlusion]:
        asked = " (the scene's model)" if model == f.scene.occlusion else ""
        yield f"### {model}: {_UNDER[model]}{asked}\n"
        rows = []
        for name, sensors in f.sensors.items():
            mine = {
                target_label(r): r.by_occlusion_percent.get(model, r.zeta_percent)
                for r in f.zetas
                if r.setup == name
            }
            mark = "**" if name == f.name else ""
            cells = [f"{mark}{mine[label]:.2f}{mark}" for label in labels]
            rows.append(
                [f"{mark}{'this setup' if mark else escaped(name)}{mark}", str(sensors), *cells]
            )
        yield table(["setup", "sensors", *labels], rows, right=range(1, len(labels) + 2))
    for r in f.own:
        if r.worst is not None:
            yield (
                f"{target_label(r)} in the worst pose, {r.worst.pose}: {r.worst.zeta_percent:.2f}"
                " %.\n"
            )
    told = [*unseeing_lines(f.own[0].unseeing), *scene_lines(f.scene)]
    if told:
        yield "\n".join(f"- {escaped(line)}" for line in told) + "\n"


def _separation(f: Facts) -> Iterator[str]:
    """Yield the section on V_P, if it is a target."""
    s = next((r.separation for r in f.own if r.separation is not None), None)
    if s is None:
        return
    yield "## Protective volume and separation distances\n"
    yield "\n".join(f"- {escaped(line)}" for line in protective_lines(f.own, f.setup)) + "\n"
    terms = (
        ("S_h", "way of the person during reaction and stopping", s.S_h),
        ("S_r", "way of the robot during the reaction", s.S_r),
        ("S_s", "stopping distance of the robot", s.S_s),
        ("C", "intrusion distance", s.C),
        ("Z_d", "uncertainty of the person's position", s.Z_d),
        ("Z_r", "uncertainty of the robot's position", s.Z_r),
    )
    rows = [(name, text, f"{value:.3f}") for name, text, value in terms]
    rows += [
        ("**S**", "**separation distance of the fastest part**", f"**{s.largest_m:.3f}**"),
        ("", "mean over the parts and poses", f"{s.mean_m:.3f}"),
        ("", "smallest", f"{s.least_m:.3f}"),
    ]
    yield table(("term", "meaning", "m"), rows, right=(2,))


def _robust(f: Facts) -> Iterator[str]:
    yield "## Redundancy, losses and tolerance\n"
    over = (
        ""
        if f.robust_poses == len(f.scene.poses)
        else f" over {f.robust_poses} representative poses"
    )
    yield f"In percent of each target{over}, under `{f.scene.occlusion}`.\n"
    labels = [target_label(r) for r in f.robust]
    yield table(["", *labels], robustness_rows(f.robust), right=range(1, len(labels) + 1))
    for r in f.robust:
        told, _, _ = lines(r).rpartition(";")
        yield f"- {target_label(r)}: {escaped(told)}."
    yield ""


def _faults(f: Facts) -> Iterator[str]:
    if f.broken:
        yield "Violated rules of the scene or of a real mount:\n"
        yield "\n".join(f"- {escaped(line)}" for line in f.broken) + "\n"


def _effective(f: Facts) -> Iterator[str]:
    if told := sensor_lines(sensor_records(f.setup)):
        yield code("\n".join(told))


def _listed_versions(versions: Mapping[str, str]) -> str:
    return escaped(", ".join(f"{name} {number}" for name, number in versions.items()))


def _reproduce(f: Facts, words: Sequence[str], versions: Mapping[str, str]) -> Iterator[str]:
    yield "## Reproduce\n"
    if f.found is not None:
        yield f"The placement was found {escaped(f.found.created)} with seed {f.found.seed} in"
        yield f"{f.found.seconds:.0f} s ({escaped(f.found.outcome)}), by"
        yield f"{_listed_versions(f.found.versions)}:\n"
        yield _command_of(f.found.command)
        if f.found.bound_percent is not None:
            reached, bound = f.found.exact_percent, f.found.bound_percent
            yield "No layout within the budget and the rules of that search reaches more than"
            yield f"{bound:.2f} %; its answer reached {reached:.2f} %.\n"
    yield f"This report, with seed {f.seed} for its random draws, was created by"
    yield f"{_listed_versions(versions)}:\n"
    yield command(["place-rings", *words])
    yield "To prove a ζ, as a guaranteed interval:\n"
    target, say = f.scene.goals[0].target, ["place-rings", "verify"]
    if target.plain:
        radius = "" if target.radius is None else f":{target.radius:g}"
        say += [*_without(words[1:], _ASKED), "--target", f"{target.name}{radius}"]
    else:
        say += _without(words[1:], _ASKED[2:])
    yield command([*say, "--rule", "certified"])


def _command_of(text: str) -> str:
    """Return a recorded command as a code block; a text that is no command line stays as it is."""
    try:
        words = shlex.split(text)
    except ValueError:
        return code(text)
    return command(words) if words and shlex.join(words) == text else code(text)


def _without(words: Sequence[str], options: Collection[str]) -> Iterator[str]:
    """Yield the words of a command line without the given options and their values."""
    left = iter(words)
    for word in left:
        option, together, _ = word.partition("=")
        if option in _FLAGS:
            continue
        if option not in options:
            yield word
        elif not together:
            next(left, None)


def _limits(f: Facts) -> Iterator[str]:
    yield "## Limits\n"
    yield f"- {DISCLAIMER}"
    yield (
        "- Coverage is geometry: the share of a volume inside the sensors' nominal beams. A sensor"
        " sees a small or dark"
    )
    yield "  object in strong light less far."
    if f.scene.robot.bodies:
        yield f"- {ADVICE}"
    yield (
        "- The model contains the robot's capsules and the obstacles' convex hulls, but no cables"
        " or holders."
    )
    yield "- Only the poses of the scene are evaluated, not the motion between them."
    yield (
        f"- Blind spots are made of voxels of {f.voxel:g} m: a covered sheet thinner than that"
        " does not separate them."
    )
    mountings = counted(f.robust[0].errors.draws, "drawn mounting")
    yield (
        f"- The figures under mounting errors have the Monte Carlo error of {mountings}; all"
        " others are counts of voxels.\n"
    )
