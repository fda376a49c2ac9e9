"""A scene: what is wanted, on which robot, in which poses, and what is allowed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError

from ._catalogue import robots
from ._errors import InputError, input_errors
from ._targets import TargetVolume, volume_of
from ._trajectory import Trajectory
from .coverage.occlusion.model import OCCLUSIONS, Occlusion
from .coverage.rings.ring import Ring
from .coverage.robots.built_in import PAPER_ROBOTS
from .coverage.robots.robot import Robot
from .coverage.robots.separation_distance import Safety
from .coverage.sensors.sensor import Sensor
from .formats.errors import explain
from .formats.schema.obstacle_models import ObstacleModel, obstacles_of
from .formats.schema.scene_models import SceneFile, SceneModel
from .objectives.scene import Limits, Obstacle, Pose, Rules
from .objectives.scene import Scene as CoreScene

Poses = Trajectory | Sequence[Pose] | Sequence[Sequence[float]] | Any
_KEYS = (
    "robot",
    "targets",
    "poses",
    "sensor",
    "occlusion",
    "ring_radius",
    "mounts",
    "rules",
    "obstacles",
    "over_poses",
    "safety",
)


_KINDS: dict[str, type] = {
    "sensor": Sensor,
    "rules": Rules,
    "safety": Safety,
    "mounts": Mapping,
    "obstacles": Obstacle,
}


class Scene:
    """What is wanted, on which robot, in which poses, and what is allowed.

    A scene does not change; ``replace`` makes another. Without arguments it is the reference
    scene: a UR10 in one pose, the shell of 0.5 m, the paper's sensor.

    Args:
        robot: a name of ``robots``, or a ``Robot``.
        targets: target volumes such as ``Shell(0.5, weight=0.6)``; one or more.
        poses: a ``Trajectory``; ``Pose``s; or joint angles, rad, of one pose (J,) or of P poses
            (P, J), which then weigh the same. The robot's rest pose by default.
        sensor: of new rings.
        occlusion: what the robot's own body does to its sensors: ``ignore`` (the paper),
            ``shadow`` (points behind a body are not covered), ``blind`` (a one-zone sensor sees
            nothing beyond the nearest surface in its beam).
        ring_radius: of new rings, m; by default 0.08, more where a real ring needs it.
        mounts: limits of rings by the name of the link.
        rules: what makes a setup buildable.
        obstacles: of the cell, each made by ``obstacle``.
        over_poses: whether a search makes the ``mean`` over the poses large, or the ``worst``.
        safety: what the distances of ``ProtectiveVolume`` are made of.

    Raises:
        InputError: in one line, which names the argument, what was given and what is allowed.

    Example:
        >>> import place_rings as pr
        >>> scene = pr.Scene(robot="ur10e", targets=[pr.Shell(0.5)], occlusion="shadow")
        >>> scene
        <Scene: ur10e, 1 pose, V_S(0.5), occlusion shadow>
    """

    __slots__ = ("_core",)
    _core: CoreScene

    def __init__(
        self,
        robot: Robot | str = "ur10",
        *,
        targets: Sequence[TargetVolume] = (),
        poses: Poses = None,
        sensor: Sensor | None = None,
        occlusion: Occlusion = "ignore",
        ring_radius: float | None = None,
        mounts: Mapping[str, Limits] | None = None,
        rules: Rules | None = None,
        obstacles: Sequence[Obstacle] = (),
        over_poses: Literal["mean", "worst"] = "mean",
        safety: Safety | None = None,
    ) -> None:
        given = {
            "sensor": sensor,
            "rules": rules,
            "safety": safety,
            "limits": None if mounts is None else dict(mounts),
            "ring_radius": ring_radius,
            "radius_stated": None if ring_radius is None else True,
        }
        given_kinds = given | {"occlusion": occlusion, "over_poses": over_poses, "mounts": mounts}
        _check_kinds(given_kinds | {"obstacles": tuple(obstacles)})
        core = CoreScene(
            robot=_robot(robot),
            occlusion=occlusion,
            obstacles=tuple(obstacles),
            over_poses=over_poses,
            **{key: value for key, value in given.items() if value is not None},  # type: ignore[arg-type]
        )
        if targets:
            core = replace(core, goals=_goals(targets))
        object.__setattr__(self, "_core", _checked(_with_poses(core, poses)))

    @classmethod
    def of(cls, core: CoreScene) -> "Scene":
        """The scene around one of ``place_rings.objectives``, as files and commands have it."""
        scene = cls.__new__(cls)
        object.__setattr__(scene, "_core", core)
        return scene

    @property
    def core(self) -> CoreScene:
        """The same for the rooms below, which may change from version to version."""
        return self._core

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._core.robot

    @property
    def targets(self) -> tuple[TargetVolume, ...]:
        """The target volumes."""
        return tuple(volume_of(goal) for goal in self._core.goals)

    @property
    def poses(self) -> tuple[Pose, ...]:
        """The poses; of a trajectory those that stand for it."""
        return self._core.poses

    @property
    def sensor(self) -> Sensor:
        """The sensor of new rings."""
        return self._core.sensor

    @property
    def occlusion(self) -> Occlusion:
        """What the robot's own body does to its sensors."""
        return self._core.occlusion

    @property
    def ring_radius(self) -> float | None:
        """The radius that is stated for new rings, m; None where none is."""
        return self._core.ring_radius if self._core.radius_stated else None

    @property
    def mounts(self) -> Mapping[str, Limits]:
        """Limits of rings by link."""
        return dict(self._core.limits)

    @property
    def rules(self) -> Rules:
        """What makes a setup buildable."""
        return self._core.rules

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """What stands in the cell."""
        return self._core.obstacles

    @property
    def over_poses(self) -> Literal["mean", "worst"]:
        """What a search makes large of several poses."""
        return self._core.over_poses

    @property
    def safety(self) -> Safety:
        """What the distances of ``ProtectiveVolume`` are made of."""
        return self._core.safety

    def replace(self, **changes: Any) -> "Scene":
        """The scene with other values of some arguments.

        Raises:
            InputError: for an argument that ``Scene`` has not, or a value that it refuses.

        Example:
            >>> import place_rings as pr
            >>> pr.Scene().replace(occlusion="blind").occlusion
            'blind'
        """
        for key in changes:
            if key not in _KEYS:
                raise InputError(f"found {key}, allowed: {', '.join(_KEYS)}", "replace")
        core = self._core
        if "robot" in changes and "poses" not in changes:
            at_rest = len(core.poses) == 1 and np.array_equal(core.poses[0].q, core.robot.rest)
            core = replace(core, robot=_robot(changes["robot"]))
            core = _with_poses(core, None) if at_rest else core
        elif "robot" in changes:
            core = replace(core, robot=_robot(changes["robot"]))
        _check_kinds(changes)
        fields: dict[str, Any] = {
            key: changes[key]
            for key in ("sensor", "occlusion", "rules", "over_poses", "safety")
            if key in changes
        }
        if "mounts" in changes:
            fields["limits"] = dict(changes["mounts"])
        if "obstacles" in changes:
            fields["obstacles"] = tuple(changes["obstacles"])
        if "targets" in changes:
            fields["goals"] = _goals(changes["targets"])
        if (radius := changes.get("ring_radius")) is not None:
            fields |= {"ring_radius": radius, "radius_stated": True}
        core = replace(core, **fields)
        if "poses" in changes:
            core = _with_poses(replace(core, recorded=None), changes["poses"])
        return Scene.of(_checked(core))

    def ring(
        self, link: str, position: float, count: int, *, tilt: float = 0.0, phase: float = 0.0
    ) -> Ring:
        """A ring with the sensor and the radius that the scene has for this link.

        Args:
            link: a mount of the robot.
            position: 0 (proximal) to 1 (distal) along the mount axis.
            count: sensors.
            tilt: of each sensor's axis out of the ring's plane, positive toward distal, rad.
            phase: of the first sensor about the mount axis, rad.

        Raises:
            InputError: for a link that the robot has not, or a value out of range.

        Example:
            >>> import place_rings as pr
            >>> pr.Scene().ring("forearm", 0.5, 16).radius
            0.08
        """
        with input_errors("ring"):
            self.robot.mount(link)
            radius, sensor = self._core.radius_of(link), self._core.sensor_of(link)
            return Ring(link, position, count, tilt, phase, radius, sensor)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a scene does not change; use scene.replace({name}=...)")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("a scene does not change")

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene.of, (self._core,)

    def __repr__(self) -> str:
        return f"<Scene: {', '.join(self._parts())}>"

    def _repr_html_(self) -> str:
        items = "".join(f"<li>{escape(part)}</li>" for part in self._parts())
        return f"<b>Scene</b><ul>{items}</ul>"

    def _parts(self) -> list[str]:
        core = self._core
        poses = f"{len(core.poses)} pose{'s' * (len(core.poses) != 1)}"
        goals = ", ".join(
            str(g.target) + (f" (weight {g.weight:g})" if len(core.goals) > 1 else "")
            for g in core.goals
        )
        parts = [core.robot.name, poses, goals, f"occlusion {core.occlusion}"]
        if core.obstacles:
            parts.append(f"{len(core.obstacles)} obstacles")
        return parts


def core_scene(scene: Scene | CoreScene) -> CoreScene:
    """The scene for the rooms below.

    Raises:
        InputError: if it is no scene.
    """
    if isinstance(scene, Scene):
        return scene.core
    if isinstance(scene, CoreScene):
        return scene
    raise InputError(f"found a {type(scene).__name__}, allowed: Scene", "scene")


def obstacle(
    name: str = "",
    *,
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    rpy_deg: Sequence[float] = (0.0, 0.0, 0.0),
    size: Sequence[float] | None = None,
    points: Sequence[Sequence[float]] | None = None,
    floor: float | None = None,
) -> Obstacle:
    """A convex obstacle of the cell: it shadows sensors, and is no part of a target.

    Args:
        name: that reports use.
        centre: of a box or of the points' frame, m, base frame.
        rpy_deg: turns about x, y and z of the base frame, in this order, degrees.
        size: of a box, m.
        points: (N, 3) m, of which it is the convex hull.
        floor: everything below this height, m.

    Raises:
        InputError: unless exactly one of ``size``, ``points`` and ``floor`` is given and in range.

    Example:
        >>> import place_rings as pr
        >>> pr.obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2]).name
        'table'
    """
    keys: dict[str, Any] = {
        "name": name,
        "centre": [float(v) for v in centre],
        "rpy_deg": [float(v) for v in rpy_deg],
        "size": None if size is None else [float(v) for v in size],
        "points": None if points is None else [[float(v) for v in p] for p in points],
        "floor": None if floor is None else float(floor),
    }
    try:
        model = ObstacleModel(**keys)
    except ValidationError as error:
        raise InputError(str(explain("obstacle", error, ObstacleModel))) from error
    return obstacles_of([model])[0]


def _robot(robot: Robot | str) -> Robot:
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str) or robot not in robots:
        raise InputError(
            f"unknown robot {robot!r}; known: {', '.join(robots)}, or a Robot, as load reads it",
            "robot",
        )
    return robots[robot]


def _check_kinds(given: Mapping[str, Any]) -> None:
    """Refuse values of another kind than an argument has; None stands for a default."""
    for name, one_of in (("occlusion", OCCLUSIONS), ("over_poses", ("mean", "worst"))):
        if name in given and given[name] not in one_of:
            raise InputError(f"found {given[name]!r}, allowed: {', '.join(one_of)}", name)
    for name, kind in _KINDS.items():
        value = given.get(name)
        each = value if name == "obstacles" and value is not None else (value,)
        for one in each:
            if one is not None and not isinstance(one, kind):
                raise InputError(f"found {one!r}, allowed: {kind.__name__}", name)


def _goals(targets: Sequence[TargetVolume]) -> tuple[Any, ...]:
    if isinstance(targets, TargetVolume):
        targets = [targets]
    for target in targets:
        if not isinstance(target, TargetVolume):
            raise InputError(
                f"found {target!r}, allowed: Shell, ReachSphere, ToolSphere, ReachAndToolSpheres,"
                " ProtectiveVolume",
                "targets",
            )
    if not targets:
        raise InputError("found none, allowed: one or more", "targets")
    return tuple(target.goal for target in targets)


def _with_poses(core: CoreScene, poses: Poses) -> CoreScene:
    """The scene in these poses; in the robot's rest pose where there are none."""
    if poses is None:
        own = core.robot.name in PAPER_ROBOTS
        return replace(core, poses=CoreScene.poses if own else (Pose(core.robot.rest),))
    if isinstance(poses, Trajectory):
        return poses.applied(core)
    if isinstance(poses, Pose):
        poses = [poses]
    each = list(poses)
    if each and all(isinstance(pose, Pose) for pose in each):
        return replace(core, poses=tuple(each))
    try:
        angles = np.atleast_2d(np.asarray(poses, float))
    except (TypeError, ValueError) as error:
        raise InputError(
            "found something else than numbers, allowed: a Trajectory, Poses, or joint angles in"
            " rad, (J,) or (P, J)",
            "poses",
        ) from error
    if angles.ndim != 2 or not angles.size:
        raise InputError(f"found shape {angles.shape}, allowed: (J,) or (P, J)", "poses")
    return replace(core, poses=tuple(Pose(q) for q in angles))


def _checked(core: CoreScene) -> CoreScene:
    """The scene, if its file would be read; InputError otherwise."""
    try:
        SceneModel.from_domain(core)
    except ValidationError as error:
        raise InputError(str(explain("scene", error, SceneFile))) from error
    return core
