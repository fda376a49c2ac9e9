"""Build the twin of a setup, in the scene's own model or in a model of one's own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Bool

from ...coverage.definitions.errors import InputError, input_errors
from ...coverage.definitions.options import Seed, Whole
from ...coverage.rings.ring import Setup
from ...coverage.robots.base_frame import check_base_frame
from ...formats.export.options import BaseFrameOptions
from ...formats.export.placed import PlacedSetup
from ...formats.optional_dependencies import require
from ...objectives.firing.schedule import firing_schedule
from ...objectives.options import FiringOptions
from ...objectives.scene import Scene
from .attaching import attached_world
from .bodies import TwinSolid, placed_body
from .frame_clock import frame_clock
from .look import looks
from .noise import USUAL_NOISE, Noise
from .sensor_twin import Mask, SensorTwin
from .world import TwinWorld, scene_world


@dataclass(frozen=True, kw_only=True)
class TwinOptions(BaseFrameOptions):
    """What a twin holds, and how its sensors report."""

    model: Any = None
    """MuJoCo model with the robot, as a ``mujoco.MjSpec`` or the path of an MJCF file; the sensors
    are attached to its links. Default: a model of the scene's robot and obstacles."""
    joints: Sequence[str] | None = None
    """Names of the robot's joints in ``model``, from the base on. Default: those of the scene's
    robot, also with ``_joint`` at their end."""
    bodies: Sequence[TwinSolid] = ()
    """Bodies that only the sensors meet, and that ``put`` moves: ``Sphere``, ``Box``, ``Cylinder``
    or ``Capsule``."""
    mask: Mask = "nothing"
    """Bodies that block the view, but are not reported. nothing: all are reported, the robot's own
    links, too. robot: its links are not. scene: neither are the obstacles, so that only ``bodies``
    are reported."""
    noise: Noise | None = USUAL_NOISE
    """Noise of the readings; None for exact ones."""
    scheduled: bool = False
    """Let no two sensors fire together that may disturb each other: each fires in its slot of the
    firing schedule. Default: all fire at once."""
    finer: Annotated[int, Whole(1, 32)] = 1
    """Factor on the number of rays along a side: 4 steps from ray to ray in a zone, 32 in a beam
    without zones."""
    pose: Annotated[int, Whole(0)] = 0
    """Number of the scene's pose at which the twin begins."""
    seed: Seed = 0
    """Random seed of the noise; the same seed gives the same readings."""

    def __post_init__(self) -> None:
        """Raise InputError for values that are not allowed."""
        super().__post_init__()
        _check_items("bodies", self.bodies, TwinSolid, "a list of Sphere, Box, Cylinder, Capsule")
        if self.joints is not None:
            _check_items("joints", self.joints, str, "a list of names")
            if self.model is None:
                raise InputError("found names, allowed: only with model", "joints", "", ("model",))
        if self.model is not None and self.base_frame is not None:
            line = f"found {self.base_frame}, allowed: only without model, whose own frame counts"
            raise InputError(line, "base_frame", "", ("model",))
        if not isinstance(self.noise, Noise | None):
            raise InputError(f"found a {type(self.noise).__name__}, allowed: Noise, None", "noise")


def _check_items(name: str, values: Any, kind: Any, allowed: str) -> None:
    """Raise InputError for anything but a list of items of a kind."""
    listed = isinstance(values, Sequence) and not isinstance(values, str)
    for value in values if listed else [values]:
        if not (listed and isinstance(value, kind)):
            raise InputError(f"found a {type(value).__name__}, allowed: {allowed}", name)


def sensor_twin(name: str, setup: Setup, scene: Scene, options: TwinOptions) -> SensorTwin:
    """Return the twin of a setup.

    Args:
        name: name of the setup.
        setup: the sensors on the robot.
        scene: the scene.
        options: what the twin holds, and how its sensors report.

    Raises:
        UserError: if MuJoCo is not installed, or for a model that does not fit the scene.
    """
    require("mujoco", "twin", "mujoco")
    if options.pose >= len(scene.poses):
        line = f"found {options.pose}, allowed: 0 to {len(scene.poses) - 1}"
        raise InputError(line, "pose")
    check_base_frame(scene.robot, options.base_frame)
    placed = PlacedSetup(scene, setup, options.pose, Path(), base=options.base_frame)
    bodies = [placed_body(solid) for solid in options.bodies]
    shapes = [placed_body.body for placed_body in bodies]
    if options.model is None:
        joints: Sequence[str] = placed.joint_names
        world = scene_world(placed, shapes)
    else:
        spec = _spec(options.model)
        joints = options.joints or _joints(spec, scene)
        if len(joints) != len(scene.robot.chain):
            line = f"found {len(joints)}, allowed: {len(scene.robot.chain)} names"
            raise InputError(line, "joints")
        with input_errors("model"):
            world = attached_world(spec, placed, joints, shapes)
    schedule = None
    if options.scheduled:
        schedule = firing_schedule(name, setup, scene, FiringOptions())
    everyone = scene.with_cell(setup)
    return SensorTwin(
        world=world,
        chain=scene.robot.chain,
        joints=tuple(joints),
        names=tuple(sensor.name for sensor in placed.sensors),
        clock=frame_clock(scene, everyone, schedule),
        looks=looks(everyone, options.finer),
        masked=_masked(world, joints[0], options.mask),
        noise=options.noise,
        bodies=bodies,
        seed=options.seed,
        own=options.model is None,
    )


def _spec(model: Any) -> Any:
    """Return the specification of a model.

    Raises:
        InputError: for anything else than a specification or the path of a file.
    """
    import mujoco

    if isinstance(model, mujoco.MjSpec):
        return model
    if not isinstance(model, str | Path):
        allowed = "a mujoco.MjSpec, or the path of an MJCF file"
        raise InputError(f"found a {type(model).__name__}, allowed: {allowed}", "model")
    try:
        return mujoco.MjSpec.from_file(str(model))
    except (ValueError, OSError) as error:
        raise InputError(str(error), "model", model) from error


def _joints(spec: Any, scene: Scene) -> list[str]:
    """Return the names of the robot's joints in a model, which may end with ``_joint``."""
    known = {joint.name for joint in spec.joints}
    names = scene.robot.chain.joints
    return [name if name in known else f"{name}_joint" for name in names]


def _masked(world: TwinWorld, joint: str, mask: Mask) -> Bool[np.ndarray, " G"]:
    """Return which geoms block the view, but are not reported."""
    model, held = world.model, world.model.geom_bodyid
    if mask == "nothing":
        return np.zeros(model.ngeom, bool)
    if mask == "scene":
        return np.asarray(~np.isin(model.body_mocapid[held], world.mocap))
    root = model.body_rootid[model.joint(joint).bodyid[0]]  # the robot's bodies hang together
    return np.asarray(model.body_rootid[held] == root)
