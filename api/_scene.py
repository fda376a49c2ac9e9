"""A scene: robot, poses, targets, sensor and rules."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import Any, Literal

import numpy as np

from ._errors import InputError, input_errors
from ._scene_arguments import changed, checked, robot_named, with_robot
from ._scene_poses import Poses, with_poses
from .coverage.electronics.electronics import Electronics
from .coverage.occlusion.occlusion_mode import Occlusion
from .coverage.person_reach import Person
from .coverage.rings.mounted_sensor import MountedSensor
from .coverage.rings.ring import Ring
from .coverage.robots.attached import Attached
from .coverage.robots.base_frame import BaseFrame, base_frame
from .coverage.robots.robot import Robot
from .coverage.robots.separation_distance import Safety
from .coverage.sensors.sensor import Sensor
from .coverage.targets.target import Target
from .objectives.mount_rules import Limits, Rules
from .objectives.poses import Pose
from .objectives.prices import Prices
from .objectives.scene import Obstacle, as_in_paper
from .objectives.scene import Scene as CoreScene

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
    "electronics",
    "prices",
    "base",
    "person",
)


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
        obstacles: obstacles of the cell, each each an ``Obstacle``.
        attached: tools and payloads on the robot, each an ``Attached``.
        cell_sensors: cameras and scanners of the cell: ``MountedSensor`` on the link ``base``. What
            they see counts as covered with any setup.
        over_poses: a search maximises the ``mean`` over the poses or the ``worst`` pose.
        safety: terms of the separation distance that defines ``ProtectiveVolume``.
        electronics: rate, bus and controller of each ring, which limit its sensors.
        prices: what a ring and a sensor cost; results then have a ``price``.
        base: frame of the coordinates in these arguments, for an arm of Universal Robots:
            ``base_link`` of its ROS description (the default, and the frame of all results), or
            ``pendant``, the feature Base of its pendant, which is turned by 180° about z.
        person: where people walk and how far they reach, for targets that are ``reachable`` by a
            person and for blind spots.

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
        targets: Sequence[Target] | Target | None = None,
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
        electronics: Electronics | None = None,
        prices: Prices | None = None,
        base: BaseFrame | None = None,
        person: Person | None = None,
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
            "electronics": electronics,
            "prices": prices,
            "base": base,
            "person": person,
        }
        if attached is not None:
            given["attached"] = attached
        with input_errors("scene"):
            core = changed(CoreScene(robot=robot_named(robot)), given)
        object.__setattr__(self, "_core", checked(with_poses(core, poses)))

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
    def targets(self) -> tuple[Target, ...]:
        """The target volumes."""
        return self._core.targets

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
        return dict(self._core.mounts)

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
    def electronics(self) -> Electronics:
        """Rate, bus and controller of each ring."""
        return self._core.electronics

    @property
    def prices(self) -> Prices | None:
        """What a ring and a sensor cost; None if unknown."""
        return self._core.prices

    @property
    def base(self) -> BaseFrame | None:
        """Frame of all coordinates of the scene: ``base_link``, except for ``ur10_dh``; None for a
        robot that is no arm of Universal Robots."""
        return base_frame(self._core.robot)

    @property
    def person(self) -> Person | None:
        """Where people walk and how far they reach; None if it is not stated."""
        return self._core.person

    def replace(self, **changes: Any) -> "Scene":
        """Return a copy of the scene with other values of some arguments.

        On a UR10 ``rules.mount`` decides on which axes rings sit: real ones on those of the links'
        tubes, rings without bodies on the lines between the joints.

        Args:
            changes: arguments of ``Scene``; None restores an argument's default. ``base`` is the
                frame of the coordinates in the same call.

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
            core = with_robot(core, changes)
            core = with_poses(core, None) if at_rest else core
        elif "robot" in changes:
            core = with_robot(core, changes)
        with input_errors("scene"):
            core = changed(core, changes)
        if "poses" in changes:
            core = with_poses(replace(core, recorded=None), changes["poses"])
        return Scene.of(checked(core))

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
            str(g) + (f" (weight {g.weight:g})" if len(core.targets) > 1 else "")
            for g in core.targets
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
