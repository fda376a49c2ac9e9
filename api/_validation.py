"""Checks of scenes and setups before a count, and the forms in which functions accept a setup."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pydantic import ValidationError

from ._arguments import number
from ._errors import InputError, input_errors
from .coverage.definitions.errors import explain, key_path, shown
from .coverage.rings.ring import Ring, Setup
from .coverage.rings.rounding import setup_faults, with_scene, within_files
from .formats.loader import resolve
from .objectives.occlusion import own_link_fault
from .objectives.scene import Scene
from .objectives.separation_summary import separations
from .objectives.target_voxels import check_beams, check_voxel, target_voxels


class Placed(Protocol):
    """An object with a setup in a scene, as all results are."""

    name: str
    """Name of the setup."""
    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the setup."""


@dataclass(frozen=True)
class ResolvedSetup:
    """A setup that a command has read already."""

    name: str
    """Name such as ``n2_16_25``, or the path of the file."""
    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the setup."""


SetupLike = Setup | str | Path | Placed | ResolvedSetup

_COARSE = 0.1  # m; above it, counting the voxels of a target is fast


@dataclass(frozen=True)
class SetupCall:
    """A call of a function of a setup in a scene."""

    setup: SetupLike
    """A ``Setup``, a name such as ``n2_16_25``, the path of a proposal or of a list of sensors
    (.csv, .json, .urdf), or a result."""
    scene: Scene | None = None
    """Scene of the setup; by default the proposal's own, or the reference scene."""


def given_scene(scene: Any) -> Scene:
    """Return the scene of a call, by default the reference scene.

    Raises:
        InputError: for anything else than a scene.
    """
    if not isinstance(scene, Scene | None):
        raise InputError(f"found a {type(scene).__name__}, allowed: Scene", "scene")
    return Scene() if scene is None else scene


def check_scene(scene: Scene, voxel: float) -> None:
    """Check that a scene can be counted.

    Raises:
        InputError: otherwise.
    """
    number("voxel", voxel, "m, above 0")
    with input_errors():
        check_beams(scene.sensors, voxel)
    for goal in scene.targets:
        try:
            separations(scene, goal.target)
        except ValueError as error:
            raise InputError(str(error), "target", goal.target) from error
        with input_errors("voxel"):
            solid = scene.solid(goal.target, 0)
            check_voxel(solid, voxel)
            if voxel > _COARSE and len(target_voxels(solid, voxel, "sampled")) == 0:
                raise ValueError(
                    f"voxel {voxel:g} m is larger than target {goal.target}; allowed: smaller"
                )


def check_search_sight(scene: Scene) -> None:
    """Check that the rings of a search do not all lie inside their own links.

    Raises:
        InputError: otherwise.
    """
    if scene.real or scene.occlusion == "ignore":
        return
    rings = [Ring(link, 0.5, 1, radius=scene.radius_of(link)) for link in scene.robot.links]
    if (fault := own_link_fault(scene, Setup(tuple(rings)))) is not None:
        raise InputError(fault)


def resolve_setup(setup: Any, scene: Scene | None) -> tuple[str, Setup, Scene]:
    """Return the name, the setup and the scene for a caller's arguments.

    Args:
        setup: a ``Setup``, a name such as ``n2_16_25``, the path of a file, or a result.
        scene: the scene; None for that of the result or the file, else the reference scene.

    Raises:
        InputError: for anything else, or if the scene's robot lacks a link of the setup.
    """
    core = None if scene is None else given_scene(scene)
    if isinstance(setup, ResolvedSetup):
        return setup.name, setup.setup, core or setup.scene
    if isinstance(setup, str | Path):
        with input_errors():
            placed, core = resolve(str(setup), core)
            return str(setup), placed, core
    name, own = "setup", None
    if not isinstance(setup, Setup) and isinstance(getattr(setup, "setup", None), Setup):
        name, own, setup = setup.name, given_scene(setup.scene), setup.setup
    if not isinstance(setup, Setup):
        raise InputError(
            f"found a {type(setup).__name__}, allowed: a Setup, a name like n2_16_25, a file's"
            " path, or a result",
            "setup",
        )
    if not setup.groups:
        raise InputError("found no ring or single sensor, allowed: one or more", "setup")
    core = core or own or Scene()
    setup = with_scene(setup, core.sensor, core.default_radius)
    faults = setup_faults(setup, core.robot, core.sensor, ("rings", "singles"))
    for where, value, allowed in faults:
        line = f"{key_path(where)}: found {shown(value)}, allowed: {allowed}"
        raise InputError(line, "setup")
    try:
        within_files(setup)
    except ValidationError as error:
        raise InputError(str(explain("setup", error, Setup))) from error
    return name, setup, core
