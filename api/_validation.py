"""What is refused of a scene or a setup before anything is counted, and the setup that a caller
means.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from pydantic import ValidationError

from ._arguments import number
from ._errors import InputError, input_errors
from ._scene import Scene, core_scene
from .coverage.rings.ring import Ring, Setup
from .formats.errors import explain
from .formats.loader import resolve
from .formats.schema.ring_models import RingModel, ring_models
from .formats.schema.scene_models import SceneModel
from .objectives.occlusion import check_bodies, check_mounting
from .objectives.scene import Scene as CoreScene
from .objectives.separation_summary import separations
from .objectives.target_voxels import check_voxel, target_voxels


class Placed(Protocol):
    """What holds a setup in a scene, as all results do."""

    name: str
    setup: Setup
    scene: Scene


@dataclass(frozen=True)
class ResolvedSetup:
    """A setup that is read already, as commands have it.

    name: a name like ``n2_16_25``, or the file's. scene: where it is looked at.
    """

    name: str
    setup: Setup
    scene: CoreScene


SetupLike = Setup | str | Path | Placed | ResolvedSetup

_NAME = re.compile(r"n\d+_[^/\\.]*(\.\d+)?")
_STEP, _STEPS = 0.005, 15  # m, by which a ring of the paper is widened, and how often at most
_COARSE = 0.1  # m: from here on it is quick to see whether a target holds a voxel at all


def check_scene(scene: CoreScene, voxel: float) -> None:
    """Refuse what cannot be counted or written before anything is tried: InputError."""
    number("voxel", voxel, "m, above 0")
    try:
        SceneModel.from_domain(scene)
    except ValidationError as error:
        raise InputError(str(explain("the scene", error, SceneModel))) from error
    for goal in scene.goals:
        try:
            separations(scene, goal.target)
        except ValueError as error:
            raise InputError(str(error), "target", goal.target) from error
        with input_errors("voxel"):
            solid = scene.solid(goal.target, 0)
            check_voxel(solid, voxel)
            if voxel > _COARSE and len(target_voxels(solid, voxel, "centre")) == 0:
                raise ValueError(
                    f"voxel {voxel:g} m is larger than target {goal.target}; allowed: smaller"
                )


def check_sight(scene: CoreScene, setup: Setup) -> None:
    """Refuse a setup whose sensors stand within their own link, where the scene models occlusion,
    and a robot without bodies: InputError.
    """
    if scene.occlusion == "ignore":
        return
    with input_errors():
        check_bodies(scene, scene.occlusion)
        check_mounting(scene, setup)


def check_scene_sight(scene: CoreScene) -> None:
    """Refuse a search whose rings would all lie within a link's own tube: InputError."""
    rings = (
        []
        if scene.real
        else [Ring(link, 0.5, 1, radius=scene.radius_of(link)) for link in scene.robot.links]
    )
    check_sight(scene, Setup((*rings, *scene.rules.fixed)))


def is_file(setup: str | Path) -> bool:
    """Does this name a file, and not a setup of the paper?"""
    return not _NAME.fullmatch(str(setup))


def _clear(setup: Setup, scene: CoreScene) -> Setup:
    """A setup of the paper, each ring widened until its sensors stand outside of its own link; as
    it is where the scene states a radius or ignores the robot's body.
    """
    if scene.occlusion == "ignore" or scene.radius_stated:
        return setup
    return Setup(tuple(_widened(ring, scene) for ring in setup.rings))


def _widened(ring: Ring, scene: CoreScene) -> Ring:
    for step in range(_STEPS):
        wider = replace(ring, radius=ring.radius + step * _STEP)
        try:
            check_mounting(scene, Setup((wider,)))
        except ValueError:
            continue
        return wider
    return ring


def resolve_setup(setup: Any, scene: Scene | CoreScene | None) -> tuple[str, Setup, CoreScene]:
    """Name, setup and scene that a caller means.

    ``setup`` is a ``Setup``; a name like ``n2_16_25`` or a file as the command ``verify`` takes
    them; or a result, which brings its own scene unless one is given.

    Raises:
        InputError: if it is none of them, or the scene's robot lacks a link of it.
    """
    core = None if scene is None else core_scene(scene)
    if isinstance(setup, ResolvedSetup):
        return setup.name, setup.setup, core or setup.scene
    if isinstance(setup, str | Path):
        with input_errors():
            placed, core = resolve(str(setup), core)
            return str(setup), placed if is_file(setup) else _clear(placed, core), core
    name, own = "setup", None
    if not isinstance(setup, Setup) and isinstance(getattr(setup, "setup", None), Setup):
        name, own, setup = setup.name, core_scene(setup.scene), setup.setup
    if not isinstance(setup, Setup):
        raise InputError(
            f"found a {type(setup).__name__}, allowed: a Setup, a name like n2_16_25, a file's"
            " path, or a result",
            "setup",
        )
    if not setup.rings:
        raise InputError("found no ring, allowed: one or more", "setup")
    core = core or own or CoreScene()
    links = core.robot.links
    for i, ring in enumerate(setup.rings):
        if ring.link not in links:
            raise InputError(
                f"rings[{i}].link: found {ring.link!r}, allowed: a link of {core.robot.name}:"
                f" {', '.join(links)}",
                "setup",
            )
    try:
        ring_models(setup, core.sensor)
    except ValidationError as error:
        raise InputError(str(explain("setup", error, RingModel))) from error
    return name, setup, core
