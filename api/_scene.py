"""A scene: robot, poses, targets, sensor and rules."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import ValidationError

from ._arguments import number
from ._catalogue import robots
from ._errors import InputError, input_errors
from ._own_targets import volume_of
from ._targets import TargetVolume
from ._trajectory import Trajectory
from .coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from .coverage.rings.mounted_sensor import MountedSensor
from .coverage.rings.ring import Ring
from .coverage.robots.attached import Attached
from .coverage.robots.built_in import PAPER_ROBOTS
from .coverage.robots.robot import Robot
from .coverage.robots.separation_distance import Safety
from .coverage.sensors.sensor import Sensor
from .formats.errors import explain
from .formats.schema.attached_models import AttachedModel, attached_of
from .formats.schema.convex_models import ConvexModel
from .formats.schema.obstacle_models import ObstacleModel, obstacles_of
from .formats.schema.scene_models import SceneFile, SceneModel
from .formats.schema.target_models import boxed
from .objectives.prices import Prices
from .objectives.scene import CoreScene, Limits, Obstacle, Pose, Rules, as_in_paper

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
    "attached",
    "cell_sensors",
    "over_poses",
    "safety",
    "prices",
)


_KINDS: dict[str, type] = {"sensor": Sensor, "rules": Rules, "safety": Safety}


class Scene:
    """Robot, poses, targets, sensor and rules of a placement.

    A scene is immutable; ``replace`` returns a changed copy. Without arguments it is the reference
    scene: a UR10 in one pose, the shell V_S(0.5), the paper's sensor, real rings, self-occlusion.
    ``Scene.paper`` gives the paper's world.

    Args:
        robot: a name in ``robots``, or a ``Robot``.
        targets: one or more target volumes such as ``Shell(0.5, weight=0.6)``.
        poses: a ``Trajectory``, a list of ``Pose``, joint values by name and unit such as
            ``{"rail_m": 0.3, "shoulder_deg": 20}`` (one or a list), or joint angles in rad (and m
            for prismatic joints): (J,) for one pose or (P, J) for P poses of equal weight. The
            robot's rest pose by default.
        sensor: sensor of new rings.
        occlusion: model of occlusion: ``ignore`` (transparent bodies, as in the paper), ``shadow``
            (points behind a body are not covered) or ``blind`` (a one-zone sensor covers nothing
            beyond the nearest surface in its beam). By default ``shadow``, or ``ignore`` if the
            robot has no bodies.
        ring_radius: radius of new rings, m; by default 0.08, or more if a real ring needs it.
        mounts: limits of rings by the name of the link.
        rules: rules that make a setup buildable.
        obstacles: obstacles of the cell, each made by ``obstacle``.
        attached: tools and payloads on the robot, each made by ``attached``.
        cell_sensors: cameras and scanners of the cell: ``MountedSensor`` on the link ``base``. What
            they see counts as covered with any setup.
        over_poses: a search maximises the ``mean`` over the poses or the ``worst`` pose.
        safety: terms of the separation distance that defines ``ProtectiveVolume``.
        prices: what a ring and a sensor cost; results then have a ``price``.

    Raises:
        InputError: for an invalid argument; the message states the value and the allowed ones.

    Example:
        >>> import place_rings as pr
        >>> scene = pr.Scene(robot="ur10e", targets=[pr.Shell(0.5)])
        >>> scene
        <Scene: ur10e, 1 pose, V_S(0.5), occlusion shadow>
    """

    __slots__ = ("_core",)
    _core: CoreScene

    def __init__(
        self,
        robot: Robot | str = "ur10",
        *,
        targets: Sequence[TargetVolume] | TargetVolume | None = None,
        poses: Poses = None,
        sensor: Sensor | None = None,
        occlusion: Occlusion | None = None,
        ring_radius: float | None = None,
        mounts: Mapping[str, Limits] | None = None,
        rules: Rules | None = None,
        obstacles: Sequence[Obstacle] | Obstacle | None = None,
        attached: Sequence[Attached] | Attached | None = None,
        cell_sensors: Sequence[MountedSensor] | MountedSensor | None = None,
        over_poses: Literal["mean", "worst"] = "mean",
        safety: Safety | None = None,
        prices: Prices | None = None,
    ) -> None:
        given: dict[str, Any] = {
            "targets": targets or None,
            "sensor": sensor,
            "occlusion": occlusion,
            "ring_radius": ring_radius,
            "mounts": mounts,
            "rules": rules,
            "obstacles": obstacles,
            "cell_sensors": cell_sensors,
            "over_poses": over_poses,
            "safety": safety,
            "prices": prices,
        }
        if attached is not None:
            given["attached"] = attached
        with input_errors("scene"):
            core = _changed(CoreScene(robot=_robot(robot)), given)
        object.__setattr__(self, "_core", _checked(_with_poses(core, poses)))

    @classmethod
    def paper(cls, **arguments: Any) -> "Scene":
        """Return a scene of the paper's world: transparent bodies, and rings without bodies on the
        lines between the joints.

        Args:
            arguments: arguments of ``Scene`` other than ``occlusion``; ``rules.mount`` is ``free``.

        Raises:
            InputError: as ``Scene`` does.

        Example:
            >>> import place_rings as pr
            >>> pr.Scene.paper(robot="ur5e").rules.mount
            'free'
        """
        return cls.of(as_in_paper(cls(**arguments, occlusion="ignore").core))

    @classmethod
    def of(cls, core: CoreScene) -> "Scene":
        """Return the scene that wraps a scene of ``place_rings.objectives``, the form of files."""
        scene = cls.__new__(cls)
        object.__setattr__(scene, "_core", core)
        return scene

    @property
    def core(self) -> CoreScene:
        """The internal form of the scene; not part of the public API."""
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
        """The poses; for a trajectory, the weighted poses that represent it."""
        return self._core.poses

    @property
    def sensor(self) -> Sensor:
        """The sensor of new rings."""
        return self._core.sensor

    @property
    def occlusion(self) -> Occlusion:
        """Model of occlusion: ``ignore``, ``shadow`` or ``blind``."""
        return self._core.occlusion

    @property
    def ring_radius(self) -> float | None:
        """Stated radius of new rings, m; None if the scene states none."""
        return self._core.ring_radius if self._core.radius_stated else None

    @property
    def mounts(self) -> Mapping[str, Limits]:
        """Limits of rings by link."""
        return dict(self._core.limits)

    @property
    def rules(self) -> Rules:
        """Rules that make a setup buildable."""
        return self._core.rules

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """Obstacles of the cell."""
        return self._core.obstacles

    @property
    def attached(self) -> tuple[Attached, ...]:
        """Tools and payloads on the robot."""
        return self._core.robot.attached

    @property
    def cell_sensors(self) -> tuple[MountedSensor, ...]:
        """Sensors of the cell."""
        return self._core.cell_sensors

    @property
    def over_poses(self) -> Literal["mean", "worst"]:
        """Whether a search maximises the mean over the poses or the worst pose."""
        return self._core.over_poses

    @property
    def safety(self) -> Safety:
        """Terms of the separation distance that defines ``ProtectiveVolume``."""
        return self._core.safety

    @property
    def prices(self) -> Prices | None:
        """What a ring and a sensor cost; None if unknown."""
        return self._core.prices

    def replace(self, **changes: Any) -> "Scene":
        """Return a copy of the scene with other values of some arguments.

        On a UR10 ``rules.mount`` decides on which axes rings sit: real ones on those of the links'
        tubes, rings without bodies on the lines between the joints.

        Args:
            changes: arguments of ``Scene``; None restores an argument's default.

        Returns:
            The new scene.

        Raises:
            InputError: for an argument that ``Scene`` does not have, or an invalid value.

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
            core = _with_robot(core, changes)
            core = _with_poses(core, None) if at_rest else core
        elif "robot" in changes:
            core = _with_robot(core, changes)
        with input_errors("scene"):
            core = _changed(core, changes)
        if "poses" in changes:
            core = _with_poses(replace(core, recorded=None), changes["poses"])
        return Scene.of(_checked(core))

    def ring(
        self, link: str, position: float, count: int, *, tilt: float = 0.0, phase: float = 0.0
    ) -> Ring:
        """Return a ring with the scene's sensor and ring radius for a link.

        Args:
            link: a link of the robot that carries rings.
            position: position along the link's mount axis, 0 (proximal) to 1 (distal).
            count: number of sensors.
            tilt: angle of each sensor's axis out of the ring's plane, positive toward the distal
                end, rad.
            phase: rotation of the ring about the mount axis, rad.

        Returns:
            The ring.

        Raises:
            InputError: for a link that the robot does not have, or a value out of range.

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
        raise AttributeError(f"a scene is immutable; use scene.replace({name}=...)")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("a scene is immutable")

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
        if not core.real:
            parts.append("rings without bodies")
        if core.obstacles:
            parts.append(f"{len(core.obstacles)} obstacles")
        if core.robot.attached:
            parts.append(f"attached: {', '.join(a.name for a in core.robot.attached)}")
        if core.cell_sensors:
            parts.append(f"{len(core.cell_sensors)} sensors of the cell")
        return parts


def core_scene(scene: Scene | CoreScene) -> CoreScene:
    """Return the internal form of a scene.

    Raises:
        InputError: if the argument is not a scene.
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
    """Return a convex obstacle of the cell. It occludes sensors and is excluded from targets.

    Args:
        name: name of the obstacle in reports.
        centre: (x, y, z) of the box's centre, or of the origin of the points' frame, m, base frame.
        rpy_deg: rotations about x, y and z of the base frame, in this order, degrees.
        size: (x, y, z) size of a box, m.
        points: (N, 3) points in m; the obstacle is their convex hull.
        floor: height of a floor, m; the obstacle is everything below.

    Returns:
        The obstacle, for ``Scene(obstacles=[...])``.

    Raises:
        InputError: unless exactly one of ``size``, ``points`` and ``floor`` is given and in range.

    Example:
        >>> import place_rings as pr
        >>> pr.obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2]).name
        'table'
    """
    model = _solid_model(
        ObstacleModel,
        "obstacle",
        name=name,
        centre=centre,
        rpy_deg=rpy_deg,
        size=size,
        points=points,
        floor=floor,
    )
    return obstacles_of([model])[0]


def attached(
    name: str = "",
    *,
    link: str = "tcp",
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    rpy_deg: Sequence[float] = (0.0, 0.0, 0.0),
    size: Sequence[float] | None = None,
    points: Sequence[Sequence[float]] | None = None,
    start: Sequence[float] | None = None,
    end: Sequence[float] | None = None,
    radius: float | None = None,
) -> Attached:
    """Return a tool or payload on a link. It moves with the link, belongs to the robot's body,
    occludes sensors, is excluded from targets, and rings keep clear of it.

    Args:
        name: name in reports.
        link: link whose frame carries it: a link with a mount, a joint (the link that it moves),
            ``tcp`` or ``base``.
        centre: (x, y, z) of the box's centre, or of the origin of the points' or the capsule's
            frame, m, in the link's frame.
        rpy_deg: rotations about x, y and z of the link's frame, in this order, degrees.
        size: (x, y, z) size of a box, m.
        points: (N, 3) points in m; the solid is their convex hull.
        start: (x, y, z) of the start of a capsule's axis, m.
        end: (x, y, z) of the end of a capsule's axis, m.
        radius: radius of the capsule, m.

    Returns:
        The solid, for ``Scene(attached=[...])``.

    Raises:
        InputError: unless exactly one of ``size``, ``points`` and ``start``, with ``end`` and
            ``radius``, is given and in range.

    Example:
        >>> import place_rings as pr
        >>> pr.attached("gripper", centre=[0, 0, 0.07], size=[0.1, 0.06, 0.14]).link
        'tcp'
    """
    model = _solid_model(
        AttachedModel,
        "attached",
        name=name,
        link=link,
        centre=centre,
        rpy_deg=rpy_deg,
        size=size,
        points=points,
        start=start,
        end=end,
        radius=radius,
    )
    return attached_of([model])[0]


_Solid = TypeVar("_Solid", bound=ConvexModel)


def _solid_model(model: type[_Solid], argument: str, **keys: Any) -> _Solid:
    """Return the table of a solid from values that may be integers, tuples or arrays.

    Raises:
        InputError: for values that are not numbers, or out of range.
    """

    def plain(value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        return [plain(v) for v in value] if np.ndim(value) else float(value)

    try:
        return model(**{key: plain(value) for key, value in keys.items()})
    except ValidationError as error:
        raise InputError(str(explain(argument, error, model))) from error
    except (TypeError, ValueError) as error:
        raise InputError(
            "found values that are not numbers, allowed: (x, y, z) in m, degrees for rpy_deg",
            argument,
        ) from error


def _with_robot(core: CoreScene, changes: Mapping[str, Any]) -> CoreScene:
    """Return the scene with another robot, which carries the same tools and payloads unless they
    change as well."""
    robot = _robot(changes["robot"])
    if core.robot.attached and "attached" not in changes:
        with input_errors("attached"):
            robot = robot.with_attached(core.robot.attached)
    return replace(core, robot=robot)


def _robot(robot: Robot | str) -> Robot:
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str) or robot not in robots:
        raise InputError(
            f"unknown robot {robot!r}; known: {', '.join(robots)}, or a Robot, as load returns it",
            "robot",
        )
    return robots[robot]


def _changed(core: CoreScene, given: Mapping[str, Any]) -> CoreScene:
    """Return the scene with these arguments, except robot and poses.

    Raises:
        InputError: for an invalid value, or a model of occlusion that needs the robot's bodies.
    """
    fields, occlusion = _fields(given), given.get("occlusion")
    if occlusion in ("shadow", "blind") and not core.robot.bodies:
        raise InputError(
            f"found {occlusion}, allowed: ignore, because robot {core.robot.name} has no bodies",
            "occlusion",
        )
    if "attached" in given:
        each = _each(given["attached"], Attached, "attached", "attached(...)")
        with input_errors("attached"):
            fields["robot"] = core.robot.with_attached(each)
    return replace(core, **fields)


def _fields(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the internal fields for all arguments except robot and poses; None becomes the
    default.

    Raises:
        InputError: for values of the wrong type.
    """
    fields: dict[str, Any] = {}
    for name, one_of in (("occlusion", OCCLUSIONS), ("over_poses", ("mean", "worst"))):
        if name in given:
            value = getattr(CoreScene, name) if given[name] is None else given[name]
            if value not in one_of:
                raise InputError(f"found {value!r}, allowed: {', '.join(one_of)}", name)
            fields[name] = value
    for name, kind in _KINDS.items():
        if name in given:
            value = kind() if given[name] is None else given[name]
            if not isinstance(value, kind):
                raise InputError(f"found {value!r}, allowed: {kind.__name__}", name)
            fields[name] = value
    if "prices" in given:
        if not isinstance(given["prices"], Prices | None):
            raise InputError(f"found {given['prices']!r}, allowed: Prices", "prices")
        fields["prices"] = given["prices"]
    if "mounts" in given:
        fields["limits"] = _limits(given["mounts"])
    if "obstacles" in given:
        fields["obstacles"] = _each(given["obstacles"], Obstacle, "obstacles", "obstacle(...)")
    if "cell_sensors" in given:
        allowed = "MountedSensor on the link base"
        some = given["cell_sensors"]
        fields["cell_sensors"] = _each(some, MountedSensor, "cell_sensors", allowed)
    if "targets" in given:
        default = given["targets"] is None
        fields["goals"] = CoreScene.goals if default else _goals(given["targets"])
    if "ring_radius" in given:
        radius = given["ring_radius"]
        fields["radius_stated"] = radius is not None
        fields["ring_radius"] = CoreScene.ring_radius if radius is None else radius
    return fields


def _limits(mounts: Any) -> dict[str, Limits]:
    """Return limits by the name of the link; raise InputError for anything else."""
    if not isinstance(mounts, Mapping | None):
        raise InputError(f"found {mounts!r}, allowed: Limits by the name of the link", "mounts")
    for link, limits in (mounts or {}).items():
        if not isinstance(link, str) or not isinstance(limits, Limits):
            raise InputError(
                f"found {limits!r} for {link!r}, allowed: Limits by the name of the link", "mounts"
            )
    return dict(mounts or {})


def _each(values: Any, kind: type, name: str, allowed: str) -> tuple[Any, ...]:
    """Return one value of a type, several, or None as a tuple; otherwise raise InputError."""
    if isinstance(values, kind):
        values = (values,)
    if not isinstance(values, Iterable | None):
        raise InputError(f"found {values!r}, allowed: {allowed}, one or more", name)
    each = tuple(values or ())
    for one in each:
        if not isinstance(one, kind):
            raise InputError(f"found {one!r}, allowed: {allowed}", name)
    return each


def _goals(targets: Any) -> tuple[Any, ...]:
    kinds = (
        "Shell, ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, or a volume of your"
        " own such as Box"
    )
    each = _each(targets, TargetVolume, "targets", kinds)
    if not each:
        raise InputError("found none, allowed: one or more", "targets")
    return tuple(target.goal for target in each)


def _with_poses(core: CoreScene, poses: Poses) -> CoreScene:
    """Return the scene with these poses as read-only copies, or with the robot's rest pose if there
    are none.
    """
    if isinstance(poses, Trajectory):
        core = poses.applied(core)
        return replace(core, poses=tuple(_frozen(pose) for pose in core.poses))
    return replace(core, poses=tuple(_frozen(pose) for pose in _poses(core.robot, poses)))


def _poses(robot: Robot, poses: Any) -> Sequence[Pose]:
    if poses is None:
        return CoreScene.poses if robot.name in PAPER_ROBOTS else (Pose(robot.rest),)
    if isinstance(poses, Pose | Mapping):
        poses = [poses]
    if isinstance(poses, Iterable) and not isinstance(poses, np.ndarray):
        poses = list(poses)
        if poses and all(isinstance(pose, Pose | Mapping) for pose in poses):
            return [_named(robot, one) if isinstance(one, Mapping) else one for one in poses]
    angles = np.atleast_2d(_numbers(poses))
    if np.ndim(poses) == 0 or angles.ndim != 2 or not angles.size:
        raise InputError(f"found shape {np.shape(poses)}, allowed: (J,) or (P, J)", "poses")
    return [Pose(q) for q in angles]


def _named(robot: Robot, joints: Mapping[Any, Any]) -> Pose:
    """Return the pose of joint values by name and unit; raise InputError for a wrong key."""
    with input_errors("poses"):
        for key, value in joints.items():
            number(str(key), value, "a number in the unit of its name")
        return Pose.of(robot, joints)


def _frozen(pose: Pose) -> Pose:
    """Return a pose with read-only copies of its arrays."""
    arrays = [a for a in (pose.q, pose.rate) if a is not None]
    if all(isinstance(a, np.ndarray) and a.base is None and not a.flags.writeable for a in arrays):
        return pose
    own = [_numbers(a).copy() for a in arrays]
    for array in own:
        array.setflags(write=False)
    return replace(pose, q=own[0], rate=None if pose.rate is None else own[1])


def _numbers(values: Any) -> np.ndarray:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise InputError(
            "found values that are not numbers, allowed: a Trajectory, Poses, joint values by name,"
            " or joint angles in rad, (J,) or (P, J)",
            "poses",
        ) from error


def _checked(core: CoreScene) -> CoreScene:
    """Return the scene if its file would be valid; raise InputError otherwise."""
    try:
        SceneModel.from_domain(boxed(core))
    except ValidationError as error:
        raise InputError(str(explain("scene", error, SceneFile))) from error
    return core
