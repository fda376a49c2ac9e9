"""Targets on the command line: names, radii, weights and floors, as a scene's goals."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...coverage.definitions.errors import UserError, shown
from ...coverage.robots.robot import Robot
from ...coverage.targets.named import Shell, named_target
from ...coverage.targets.target import WITH_RADIUS, Target
from ...formats.loader import read_target
from ...objectives.scene import Scene

_TARGET = re.compile(r"(?P<name>[^:=]+)(:(?P<radius>[^:=]+))?(=(?P<weight>[^:=]+))?")
_MOST_WEIGHT = 1e6
_RADIUS = "--radius 0.5"


def positive(option: str, text: str) -> float:
    """Return ``text`` as a positive finite number; the UserError names ``option``."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and 0 < value <= _MOST_WEIGHT):
        allowed = f"above 0 and at most {_MOST_WEIGHT:g}"
        raise UserError(f"{option}: found {shown(text)}, allowed: {allowed}")
    return value


def parse_goal(text: str, radius: float | None, robot: Robot, option: str = "--target") -> Target:
    """Return the goal of a text NAME[:RADIUS][=WEIGHT] or FILE[=WEIGHT], such as ``V_S:0.5=0.6``.

    Args:
        text: the text.
        radius: radius of a V_S or V_N that states none, m.
        robot: the robot, in whose base the target of a file is.
        option: the option that errors name.

    Raises:
        UserError: if the text does not state a target.
    """
    path, _, stated = text.partition("=")
    if path.lower().endswith(".toml"):
        goal = read_target(Path(path), robot)
        weight = positive(f"{option} {text}, weight", stated) if stated else goal.weight
        return replace(goal, weight=weight)
    match = _TARGET.fullmatch(text)
    if match is None:
        raise UserError(
            f"{option}: found {shown(text)}, allowed: NAME[:RADIUS][=WEIGHT], like V_S:0.5=0.6, or"
            " a target file (.toml)"
        )
    weight = positive(f"{option} {text}, weight", match["weight"]) if match["weight"] else 1.0
    own = positive(f"{option} {text}, radius", match["radius"]) if match["radius"] else None
    if own is None and match["name"] in WITH_RADIUS:
        own = radius
    try:
        return named_target(match["name"], own, weight=weight)
    except ValueError as error:
        name = text.partition("=")[0]
        hint = f"; write {name}:0.5, or add {_RADIUS}" if name in WITH_RADIUS else ""
        raise UserError(f"{option} {text}: {error}{hint}") from error


def parse_goals(targets: Sequence[str], radius: float | None, robot: Robot) -> tuple[Target, ...]:
    """Return the goals of ``--target`` and ``--radius``; empty if no target was given."""
    if radius is not None and not (math.isfinite(radius) and radius > 0):
        raise UserError(f"--radius: found {radius:g}, allowed: a positive number of metres")
    goals = tuple(parse_goal(text, radius, robot) for text in targets)
    used = any(
        g.name in WITH_RADIUS and ":" not in text for g, text in zip(goals, targets, strict=True)
    )
    if radius is not None and not used:
        raise UserError(
            f"--radius {radius:g}: allowed only with a --target V_N or V_S that has no radius of"
            " its own; add --target V_N"
        )
    return goals


def with_goals(scene: Scene, goals: tuple[Target, ...], option: str = "--radius") -> Scene:
    """Return ``scene`` with these goals, if there are any; errors name ``option``."""
    inner = scene.curve.robot_radius
    for radius in (radius for goal in goals for radius in goal.radii):
        if radius <= inner:
            raise UserError(
                f"{option}: found {radius:g}, allowed: above {inner:g} m, the radius of the robot's"
                " own volume V_R, which is no part of V_S"
            )
    first = {goal.target.key: goal.target for goal in reversed(goals)}
    for target in (goal.target for goal in goals):
        if first[target.key] != target:
            raise UserError(f"--target: found two different targets called {target}; rename one")
    return replace(scene, targets=goals) if goals else scene


def with_floors(scene: Scene, floors: Sequence[str], option: str = "--at-least") -> Scene:
    """Return ``scene`` with minimum coverages NAME[:RADIUS]=PERCENT; errors name ``option``.

    A target that the scene lacks is added with weight 0.
    """
    goals, floored = list(scene.targets), list[Target]()
    for text in floors:
        match = _TARGET.fullmatch(text)
        if match is None or not match["weight"]:
            raise UserError(
                f"{option}: found {shown(text)}, allowed: NAME[:RADIUS]=PERCENT, like V_S:1.5=60"
            )
        percent = positive(f"{option} {text}, percent", match["weight"])
        if percent > 100:
            raise UserError(
                f"{option} {text}: found {percent:g}, allowed: above 0 and at most 100 (percent)"
            )
        if match["name"] in WITH_RADIUS and not match["radius"]:
            raise UserError(
                f"{option}: found {shown(text)}, allowed: a {match['name']} with its radius, like"
                f" {match['name']}:0.5={match['weight']}"
            )
        name = text.rpartition("=")[0]
        own = (goal.target for goal in scene.targets if goal.name == name)
        target = next(own, None) or parse_goal(name, None, scene.robot, option).target
        with_goals(scene, (target,), f"{option} {text}, radius")
        if target in floored:
            raise UserError(
                f"{option} {text}: {target} has a minimum already; state one for each target"
            )
        floored.append(target)
        place = next((i for i, g in enumerate(goals) if g.target == target), None)
        if place is None:
            goals.append(replace(target, weight=0.0, at_least_percent=percent))
        else:
            goals[place] = replace(goals[place], at_least_percent=percent)
    return replace(scene, targets=tuple(goals))


def resolve_pair(targets: Sequence[str], scene: Scene) -> tuple[Target, Target]:
    """Return the two targets of a front; by default the near and the far shell."""
    goals = parse_goals(targets, None, scene.robot) or (Shell(0.5), Shell(1.5))
    if weighted := [text for text in targets if "=" in text]:
        raise UserError(
            f"--target: found {shown(weighted[0])}, allowed: no weight, because a front covers all"
            " weights"
        )
    if len(goals) != 2 or goals[0].target == goals[1].target:
        raise UserError(f"--target: found {' and '.join(targets)}, allowed: two different targets")
    near, far = with_goals(scene, goals).targets
    return near.target, far.target
