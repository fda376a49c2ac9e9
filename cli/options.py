"""What the commands' options mean: targets, scenes, numbers in range."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from ..coverage.occlusion.model import Occlusion
from ..coverage.robots.built_in import robot as built_in
from ..coverage.robots.robot import Robot
from ..coverage.targets import Target
from ..formats.errors import UserError, explain, shown
from ..formats.loader import read_robot, read_scene
from ..formats.recorded_motion import with_record
from ..formats.schema.scene_models import SceneModel
from ..objectives.scene import Goal, Pose, Rules, Scene
from ..objectives.verify import VOXEL, Rule
from ..placement.search.design import Space
from ..placement.search.layout import ring_layout

_TARGET = re.compile(r"(?P<name>[^:=]+)(:(?P<radius>[^:=]+))?(=(?P<weight>[^:=]+))?")
_MOST_WEIGHT = 1e6
LEAST_MEMORY = 0.01  # GB
RINGS_PER_LINK = 2
SENSORS_PER_RING = 16  # where neither the command nor a scene's rule says more
WIDTH = 0.1  # points, of a guaranteed interval where none is asked for


def positive(option: str, text: str) -> float:
    """``text`` as a positive finite number; UserError names the option."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and 0 < value <= _MOST_WEIGHT):
        raise UserError(f"{option}: found {shown(text)}, allowed: a positive number")
    return value


def parse_goal(text: str, radius: float | None, option: str = "--target") -> Goal:
    """NAME[:RADIUS][=WEIGHT] as a goal, for instance ``V_S:0.5=0.6``; ``radius`` is that of a V_S
    without its own, and ``option`` is blamed."""
    match = _TARGET.fullmatch(text)
    if match is None:
        raise UserError(
            f"{option}: found {shown(text)}, allowed: NAME[:RADIUS][=WEIGHT], like V_S:0.5=0.6"
        )
    weight = positive(f"{option} {text}, weight", match["weight"]) if match["weight"] else 1.0
    own = positive(f"{option} {text}, radius", match["radius"]) if match["radius"] else None
    if own is None and match["name"] == "V_S":
        own = radius
    try:
        return Goal(Target(match["name"], own), weight)
    except ValueError as error:
        raise UserError(f"{option}: found {shown(text)}, but {error}") from error


def parse_goals(targets: Sequence[str], radius: float | None) -> tuple[Goal, ...]:
    """All goals of the options ``--target`` and ``--radius``; none where no target was given."""
    if radius is not None and not (math.isfinite(radius) and radius > 0):
        raise UserError(f"--radius: found {radius:g}, allowed: a positive number of metres")
    goals = tuple(parse_goal(text, radius) for text in targets)
    used = any(
        g.target.name == "V_S" and ":" not in text for g, text in zip(goals, targets, strict=True)
    )
    if radius is not None and not used:
        raise UserError(
            f"--radius: found {radius:g}, allowed: only with a --target V_S that has no radius of"
            " its own"
        )
    return goals


def resolve_scene(
    scene: Path | None, robot: str | None, targets: Sequence[str] = (), radius: float | None = None
) -> Scene | None:
    """The scene that the options describe; None where they leave it to a proposal.

    Raises:
        UserError: for an unknown robot or target, or a shell that lies within the robot's own
            volume.
    """
    goals = parse_goals(targets, radius)
    asked = read_scene(scene) if scene else None
    if robot is not None:
        asked = _on_robot(scene, asked, given_robot(robot))
    return with_goals(asked, goals) if asked is not None else None


def urdf_of(robot: str | None) -> Path | None:
    """The file of ``--robot``, if that is a URDF."""
    return Path(robot) if robot is not None and robot.lower().endswith(".urdf") else None


def given_robot(text: str) -> Robot:
    """The robot that ``--robot`` means: built in, of a robot's file (.toml), or of a URDF, to which
    bodies and mounts are then fitted; UserError for none of them."""
    if text.lower().endswith(".toml"):
        return read_robot(Path(text))
    if (urdf := urdf_of(text)) is not None:
        from .robot_file import import_urdf  # reading meshes takes a while to load

        return import_urdf(urdf).robot
    try:
        return built_in(text)
    except ValueError as error:
        raise UserError(f"--robot: {error}, or a file .toml or .urdf") from error


def _on_robot(path: Path | None, scene: Scene | None, robot: Robot) -> Scene:
    """``scene``, that of the file at ``path``, on another robot, in that robot's own pose where the
    scene has the one of its own; UserError where its poses, mounts or rings are not that robot's.
    """
    if scene is None:
        return Scene(robot=robot, poses=(Pose(robot.rest),))
    if len(scene.poses) == 1 and np.array_equal(scene.poses[0].q, scene.robot.rest):
        scene = replace(scene, poses=(Pose(robot.rest),))
    moved = replace(scene, robot=robot)
    try:
        SceneModel.from_domain(moved)
    except ValidationError as error:
        raise explain(f"--robot {robot.name}: {path}", error, SceneModel) from error
    return moved


def with_goals(scene: Scene, goals: tuple[Goal, ...], option: str = "--radius") -> Scene:
    """``scene`` with these goals in place of its own, if there are any; ``option`` is blamed."""
    for goal in goals:
        inner = scene.shape.robot_radius
        if goal.target.radius is not None and goal.target.radius <= inner:
            raise UserError(
                f"{option}: found {goal.target.radius:g}, allowed: above {inner:g}, the radius of"
                " the robot's own V_R"
            )
    return replace(scene, goals=goals) if goals else scene


def with_occlusion(scene: Scene, occlusion: Occlusion | None) -> Scene:
    """``scene`` under ``--occlusion``, if that is given; UserError for a robot that has no bodies
    to shadow or blind.
    """
    if occlusion is None:
        return scene
    if occlusion != "ignore" and not scene.robot.bodies:
        raise UserError(
            f"--occlusion: found {occlusion}, allowed: ignore, as robot {scene.robot.name} has no"
            " bodies"
        )
    return replace(scene, occlusion=occlusion)


def with_floors(scene: Scene, floors: Sequence[str]) -> Scene:
    """``scene`` with floors NAME[:RADIUS]=PERCENT for its targets; one that is no target of it
    becomes one of weight 0.
    """
    goals, floored = list(scene.goals), list[Target]()
    for text in floors:
        match = _TARGET.fullmatch(text)
        if match is None or not match["weight"]:
            raise UserError(
                f"--at-least: found {shown(text)}, allowed: NAME[:RADIUS]=PERCENT, like V_S:1.5=60"
            )
        percent = positive(f"--at-least {text}, percent", match["weight"])
        if percent > 100:
            raise UserError(
                f"--at-least: found {percent:g}, allowed: percent, above 0 and at most 100"
            )
        if match["name"] == "V_S" and not match["radius"]:
            raise UserError(
                f"--at-least: found {shown(text)}, allowed: a V_S with its radius, like"
                f" V_S:0.5={match['weight']}"
            )
        target = parse_goal(text.rpartition("=")[0], None, "--at-least").target
        with_goals(scene, (Goal(target),), f"--at-least {text}, radius")
        if target in floored:
            raise UserError(
                f"--at-least: found {shown(text)} beside another floor for {target}, allowed: one"
            )
        floored.append(target)
        place = next((i for i, g in enumerate(goals) if g.target == target), None)
        if place is None:
            goals.append(Goal(target, 0.0, percent / 100))
        else:
            goals[place] = replace(goals[place], at_least=percent / 100)
    return replace(scene, goals=tuple(goals))


def with_motion(scene: Scene, trajectory: Path | None, degrees: bool, worst: bool = False) -> Scene:
    """``scene`` with the poses of a recorded motion in place of its own, where one is given;
    ``worst``: the worst pose is to be made large, which one pose is itself. UserError for a record
    that does not serve."""
    if degrees and trajectory is None:
        raise UserError("--degrees: found alone, allowed: only with --trajectory")
    if trajectory is not None:
        scene = with_record(scene, trajectory, degrees=degrees)
    return replace(scene, over_poses="worst") if worst and len(scene.poses) > 1 else scene


def resolve_time(seconds: float | None) -> float:
    """``--time`` as a cap, infinity where none is given."""
    if seconds is not None and not 0 < seconds < math.inf:
        raise UserError(f"--time: found {seconds:g}, allowed: a positive number of seconds")
    return math.inf if seconds is None else seconds


def resolve_pair(targets: Sequence[str], scene: Scene) -> tuple[Target, Target]:
    """The two targets of a front in ``scene``: the near and the far shell where none are given."""
    goals = parse_goals(targets, None) or (Goal(Target("V_S", 0.5)), Goal(Target("V_S", 1.5)))
    if weighted := [text for text in targets if "=" in text]:
        raise UserError(
            f"--target: found {shown(weighted[0])}, allowed: no weight, as a front has all of them"
        )
    if len(goals) != 2 or goals[0].target == goals[1].target:
        raise UserError(f"--target: found {len(goals)} target(s), allowed: two different ones")
    with_goals(scene, goals)
    return goals[0].target, goals[1].target


def resolve_reach(reach: float | None, sensors: int | None) -> float | None:
    """``--reach`` as a share; UserError where it is none, or where the number of sensors is given
    too.
    """
    if reach is None:
        return None
    if not 0 < reach < 100:
        raise UserError(f"--reach: found {reach:g}, allowed: percent, above 0 and below 100")
    if sensors is not None:
        raise UserError(
            f"--reach: found {reach:g} with --sensors {sensors}, allowed: only one of them"
        )
    return reach / 100


def resolve_space(
    scene: Scene,
    rings_per_link: int | None,
    sensors_per_ring: int | None,
    sensors: int | None,
    free: bool = False,
) -> Space | None:
    """The setups that a search may choose from; None where also the number of sensors is ``free``.

    Raises:
        InfeasibleError: where the rules leave none.
        UserError: where the rings asked for have more sensors than a scene's rule allows, or fewer,
            or are asked for beside
            free ones.
    """
    if sensors is not None or free:
        for option, rule, given in (
            ("--rings-per-link", "rings_per_link", rings_per_link),
            ("--sensors-per-ring", "sensors_per_ring", sensors_per_ring),
        ):
            if given is not None:
                beside = "--reach" if free else f"--sensors {sensors}"
                raise UserError(
                    f"{option}: found {given} with {beside}, allowed: one of the two; rings are"
                    f" free there, within rules.{rule} of a scene"
                )
        return None if free else Space(scene, sensors=sensors)
    least, most = scene.rules.sensors
    asked = (
        min(max(SENSORS_PER_RING, least), most) if sensors_per_ring is None else sensors_per_ring
    )
    if not least <= asked <= most and (least, most) != Rules().sensors:
        raise UserError(
            f"--sensors-per-ring: found {asked}, allowed: {least} to {most}, the scene's"
            " rules.sensors_per_ring"
        )
    return Space(scene, ring_layout(scene, rings_per_link or RINGS_PER_LINK, asked))


@dataclass(frozen=True)
class Counting:
    """How to count: rule, side of a voxel in m, bytes that sets of voxels may take, and, when
    certified, the width of the interval in [0, 1]; 0: none."""

    rule: Rule
    voxel: float | None
    memory: float | None = None
    width: float = 0.0


def resolve_counting(
    rule: Rule, voxel: float | None, width: float | None, memory: float | None
) -> Counting:
    """What ``--rule``, ``--voxel``, ``--width`` (points) and ``--memory`` (GB) mean together."""
    if memory is not None and not memory >= LEAST_MEMORY:
        raise UserError(f"--memory: found {memory:g}, allowed: GB, {LEAST_MEMORY:g} and more")
    if voxel is not None and not (math.isfinite(voxel) and voxel > 0):
        raise UserError(f"--voxel: found {voxel:g}, allowed: a positive number of metres")
    if rule != "certified":
        if width is not None:
            raise UserError(f"--width: found {width:g}, allowed: only with --rule certified")
        return Counting(
            rule, VOXEL if voxel is None else voxel, None if memory is None else memory * 1e9
        )
    if width is not None and not 0 < width <= 100:
        raise UserError(f"--width: found {width:g}, allowed: points, above 0 and at most 100")
    if width is None:
        width = WIDTH if voxel is None else 0.0
    return Counting(rule, voxel, None, width / 100)


def check_machines(workers: int, scheduler: str | None) -> None:
    """Where a study shall run: on so many processes of this machine, or where a scheduler says;
    UserError if on both.
    """
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", scheduler):
        raise UserError(
            f"--scheduler: found {shown(scheduler)}, allowed: tcp://HOST:PORT or tls://HOST:PORT"
        )
    if scheduler is not None and workers != 1:
        raise UserError(f"--workers: found {workers} beside --scheduler, allowed: one of the two")
