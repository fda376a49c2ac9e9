"""A scene: robot, weighted poses, weighted target volumes, sensor, mount limits and rules."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY, InitVar, field, replace
from html import escape
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, Field, ValidationError

from ..coverage.choices import BaseFrame
from ..coverage.definitions.definition import adapter, definition, refuse
from ..coverage.definitions.errors import input_errors
from ..coverage.definitions.field_types import Items, Several, as_several
from ..coverage.definitions.units import INLINE
from ..coverage.electronics.electronics import Electronics
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.person_reach import Person
from ..coverage.rings.mounted_sensor import CellSensor, MountedSensor
from ..coverage.rings.ring import RING_RADIUS, Ring, Setup
from ..coverage.robots.attached import Attached, named, refuse_file
from ..coverage.robots.base_frame import base_frame, must_turn
from ..coverage.robots.built_in import PAPER_ROBOTS, ROBOTS, UR10
from ..coverage.robots.ring_section import surrounded
from ..coverage.robots.robot import Robot
from ..coverage.robots.robot_table import RobotKey, robot_key
from ..coverage.robots.separation_distance import Safety
from ..coverage.sensors.board_packing import Printing, roomy_radius
from ..coverage.sensors.boards import NOMINAL
from ..coverage.sensors.sensor import PAPER_SENSOR, Sensor
from ..coverage.soft.sampling import sample
from ..coverage.solids.base import Difference
from ..coverage.targets.combined import TargetInFiles
from ..coverage.targets.named import Shell, named_target
from ..coverage.targets.posed_robot import Shape
from ..coverage.targets.solid import target_solid
from ..coverage.targets.target import Target, standalone
from .link_limits import LinkLimits
from .motion_limits import Motion
from .mount_rules import Limits, Rules
from .obstacle import Obstacle
from .poses import Pose, Recorded
from .prices import Prices, SetupPrice
from .scene_faults import faults
from .scene_keys import PoseOfRobot, SceneKeys, table_of_scene
from .scene_poses import poses_of, settled
from .turned_cell import states_coordinates, turned_fields

REFERENCE_POSE_DEG = (0.0, -45.0, 60.0, -105.0, -90.0, 0.0)
_REFERENCE_POSE = np.radians(REFERENCE_POSE_DEG)
_REFERENCE_POSE.setflags(write=False)  # the default of every scene


_TARGETS = (
    "Near, Shell, ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, or a volume of"
    " your own such as Box"
)
OverPoses = Literal["mean", "worst"]


def _robot_named(robot: Any) -> Robot:
    """Return the built-in robot of a name, and a robot as it is."""
    if isinstance(robot, str) and robot in ROBOTS:
        return ROBOTS[robot]
    if not isinstance(robot, Robot):
        refuse([(("robot",), robot, f"{', '.join(ROBOTS)}, or a Robot, as load returns it")])
    known: Robot = robot
    return known


_AT_REFERENCE = Field(json_schema_extra={"default": [{"q_deg": [*REFERENCE_POSE_DEG]}]})
_Target = Annotated[TargetInFiles, AfterValidator(standalone)]


@definition
class Scene:
    """Robot, poses, targets, sensor and rules of a placement. In a file (TOML) every key has a
    default: the empty file is the reference scene.

    A scene is immutable; ``replace`` returns a changed copy. Without arguments it is the reference
    scene: a UR10 in one pose, the shell V_S(0.5), the paper's sensor, real rings, self-occlusion.
    ``Scene.paper`` gives the paper's world. None as an argument stands for its default.

    A robot without bodies occludes nothing, and rings on it have no bodies either.

    Example:
        >>> import place_rings as pr
        >>> scene = pr.Scene(robot="ur10e", targets=[pr.Shell(0.5)])
        >>> scene
        <Scene: ur10e, 1 pose, V_S(0.5), occlusion shadow>
    """

    robot: Annotated[RobotKey, Field(json_schema_extra={"default": "ur10"})] = UR10
    """The robot arm: the name of a built-in one, a ``Robot``, or in a file a robot file (.toml) or
    a robot's table."""
    _: KW_ONLY
    base: BaseFrame | None = field(default=None, compare=False)
    """Frame of all coordinates in the base frame, for an arm of Universal Robots: base_link of its
    ROS description, or pendant, the feature Base of its pendant, which is turned by 180° about z.
    The scene's coordinates are in the robot's own, base_link except for ``ur10_dh``, of which this
    is the name once it was stated."""
    occlusion: Occlusion = "shadow"
    """Model of occlusion by the robot's own body: ignore (transparent bodies, as in the paper),
    shadow (points behind a body are not covered), returns (nor is what a one-zone sensor of several
    targets cannot tell from a body in its beam) or blind (a one-zone sensor covers nothing beyond
    the nearest surface in its beam); default without bodies: ignore. Obstacles always occlude."""
    ring_radius: Annotated[float, Field(gt=0, le=1)] | None = None
    """Radius of new rings, m; default 0.08, or more where a real ring needs it."""
    sensor: Sensor = PAPER_SENSOR
    """Sensor of new rings."""
    curve: Shape = field(default_factory=Shape)
    """Pose curve and the volumes about it."""
    mounts: dict[str, Limits] = field(default_factory=dict)
    """Limits of rings by the name of the link; links that are not named have the default limits."""
    poses: Annotated[Items[PoseOfRobot], Field(min_length=1, max_length=10_000), _AT_REFERENCE] = (
        Pose(_REFERENCE_POSE),
    )
    """Weighted poses, in a file tables. In Python a ``Trajectory``, a list of ``Pose``, joint
    values by name and unit such as ``{"rail_m": 0.3, "shoulder_deg": 20}`` (one or a list), or
    joint angles in rad (and m for prismatic joints): (J,) for one pose or (P, J) for P poses of
    equal weight. Default: the robot's rest pose."""
    recorded: Recorded | None = None
    """Origin of the poses, if they come from a recorded motion."""
    over_poses: OverPoses = "mean"
    """Coverage over several poses: their weighted mean or the worst pose."""
    targets: Annotated[Several[_Target], Field(min_length=1, max_length=100)] = (Shell(0.5),)
    """Weighted target volumes, one or more, such as ``Shell(0.5, weight=0.6)``."""
    safety: Safety = field(default_factory=Safety)
    """Terms of the separation distance that defines ``ProtectiveVolume``."""
    motion: Motion = field(default_factory=Motion)
    """Limits of motion for check --move."""
    link: LinkLimits = field(default_factory=LinkLimits)
    """Limits of the links of check to the robot and its rings."""
    rules: Rules = field(default_factory=Rules)
    """Rules that make a setup buildable."""
    printing: Printing = field(default_factory=Printing)
    """Parameters of printed rings."""
    electronics: Electronics = field(default_factory=Electronics)
    """Rate, bus and controller of each ring, which limit its sensors."""
    prices: Prices | None = None
    """What a ring and a sensor cost; results then have a ``price``."""
    cell_sensors: Annotated[Several[CellSensor], Field(max_length=1000)] = ()
    """Cameras and scanners of the cell: in Python ``MountedSensor`` on the link ``base``, in a file
    without a link. What they see counts as covered with any setup."""
    obstacles: Annotated[Several[Obstacle], Field(max_length=1000)] = ()
    """Obstacles of the cell, each an ``Obstacle``; they occlude and belong to no target."""
    person: Person | None = None
    """Where people walk and how far they reach, for targets that are ``reachable`` by a person and
    for blind spots."""
    attached: Annotated[Several[Attached], Field(max_length=1000)] | None = field(
        default=None, compare=False
    )
    """Tools and payloads, each an ``Attached``; they move with their links and belong to the
    robot's body. Default: those that the robot carries."""

    _keys: InitVar[Annotated[SceneKeys | None, INLINE]] = None  # of a file only

    if TYPE_CHECKING:  # what Python may pass beside the fields' own types

        def __init__(self, robot: Robot | str = UR10, **arguments: Any) -> None: ...

    @classmethod
    def _of_arguments(cls, given: dict[str, Any]) -> dict[str, Any]:
        """Return arguments of Python with the defaults that depend on the robot; None stands for a
        default."""
        given = {name: value for name, value in given.items() if value is not None}
        robot = given["robot"] = _robot_named(given.get("robot", UR10))
        if isinstance(rules := given.get("rules", Rules()), Rules) and not robot.bodies:
            given["rules"] = replace(rules, mount="free")
        poses: Any = given.get("poses")
        if hasattr(poses, "on_robot"):  # a Trajectory
            given["poses"], given["recorded"] = poses.on_robot(robot)
        given["targets"] = goals = as_several(given.get("targets", cls.targets))
        for i, goal in enumerate(goals if isinstance(goals, tuple) else (goals,)):
            if not isinstance(goal, Target | Mapping):
                refuse([(("targets", i), goal, _TARGETS)])
        given = _of_robot(robot, given)
        return given | {"poses": poses_of(robot, given.get("poses", cls.poses))}

    @classmethod
    def _of_table(cls, table: dict[str, Any]) -> dict[str, Any]:
        """Return a table with the defaults that depend on the robot."""
        try:
            robot: Robot = adapter(RobotKey).validate_python(table.get("robot", UR10))
        except ValidationError:
            return table  # the field's own validation reports the error
        keys: SceneKeys = table.get("_keys") or SceneKeys()
        if keys.trajectory is not None and "poses" in table:
            allowed = "either poses or a trajectory, not both"
            refuse([(("trajectory",), keys.trajectory.file, allowed)])
        if isinstance(rules := table.get("rules", {}), dict) and not robot.bodies:
            table["rules"] = {"mount": "free"} | rules
        return _of_robot(robot, table | {"robot": robot})

    def _as_table(self, table: dict[str, Any]) -> dict[str, Any]:
        """Return the table of a file."""
        own = base_frame(self.robot) if states_coordinates(self) else None
        return table_of_scene(self, table | {"base": self.base or own})

    def __post_init__(self, keys: SceneKeys | None) -> None:
        """Attach tools, put the links into use that the rules ask for, and turn coordinates into
        the robot's own base."""
        robot = keys.calibrated(self.robot) if keys else self.robot
        if self.attached is not None and self.attached is not robot.attached:
            robot = robot.with_attached(self.attached)
        robot = robot.with_links(self.real)
        obstacles = named(self.obstacles, "obstacle")
        for solid in obstacles:
            refuse_file(solid)
        self._set(robot=robot, attached=robot.attached, obstacles=obstacles)
        if keys:
            self._set(**keys.fields(self, robot))
        if robot.chain.mimics:
            self._set(poses=tuple(settled(pose, robot.chain) for pose in self.poses))
        try:
            turns = must_turn(robot, self.base)
        except ValueError as error:
            refuse([(("base",), self.base, str(error))])
        if self.base is not None:
            self._set(base=base_frame(robot) or "base_link")
        if turns:
            self._set(**turned_fields(self))
        refuse(faults(self))

    def _set(self, **fields: Any) -> None:
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def replace(self, **changes: Any) -> "Scene":
        """Return a copy of the scene with other values of some arguments.

        Another robot carries the same tools, and stands at its own rest pose if this one does. On a
        UR10 ``rules.mount`` decides on which axes rings sit: real ones on those of the links'
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
        if "robot" in changes:
            changes = self._for_robot(Scene(changes["robot"]).robot, changes)
        if changes.get("base") not in (None, self.base):
            new = Scene(changes.pop("robot", self.robot), **changes)
            changes = {name: getattr(new, name) for name in (*changes, "robot")}
        if "poses" in changes:
            changes = {"recorded": None} | changes
        if changes.get("attached", ()) is None:
            changes["attached"] = ()
        return replace(self, **changes)

    def _for_robot(self, robot: Robot, changes: dict[str, Any]) -> dict[str, Any]:
        """Return changes of a scene's robot with those that follow from it."""
        follows: dict[str, Any] = {"base": base_frame(robot) if self.base else None}
        if not robot.bodies:
            follows |= {"occlusion": None, "rules": replace(self.rules, mount="free")}
        if len(self.poses) == 1 and np.array_equal(self.poses[0].q, self.robot.rest):
            follows["poses"] = None
        return follows | changes | {"robot": robot}

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
        return as_in_paper(cls(**arguments, occlusion="ignore"))

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
            radius, sensor = self.radius_of(link), self.sensor_of(link)
            return Ring(link, position, count, tilt, phase, radius, sensor)

    def __repr__(self) -> str:
        return f"<Scene: {', '.join(self._parts())}>"

    def _repr_html_(self) -> str:
        items = "".join(f"<li>{escape(part)}</li>" for part in self._parts())
        return f"<b>Scene</b><ul>{items}</ul>"

    def _parts(self) -> list[str]:
        poses = f"{len(self.poses)} pose{'s' * (len(self.poses) != 1)}"
        goals = ", ".join(
            str(g) + (f" (weight {g.weight:g})" if len(self.targets) > 1 else "")
            for g in self.targets
        )
        parts = [self.robot.name, poses, goals, f"occlusion {self.occlusion}"]
        if not self.real:
            parts.append("rings without bodies")
        if self.obstacles:
            parts.append(f"{len(self.obstacles)} obstacles")
        if self.robot.attached:
            parts.append(f"attached: {', '.join(a.name for a in self.robot.attached)}")
        if self.cell_sensors:
            parts.append(f"{len(self.cell_sensors)} sensors of the cell")
        return parts

    def with_cell(self, setup: Setup) -> Setup:
        """Return the setup with the cell's sensors after its own single sensors."""
        if not self.cell_sensors:
            return setup
        return replace(setup, singles=(*setup.singles, *self.cell_sensors))

    @property
    def standing(self) -> tuple[MountedSensor, ...]:
        """The single sensors that a search keeps: those fixed on the robot and those of the
        cell."""
        return (*self.rules.fixed_sensors, *self.cell_sensors)

    def solid(self, target: Target, pose: int) -> Difference:
        """Return the target volume at a pose, less V_R and the obstacles.

        Raises:
            ValueError: as ``target_solid`` does.
        """
        at, stands = self.poses[pose], tuple(o.body for o in self.obstacles)
        return target_solid(
            target, self.robot, at.q, self.curve, stands, at.rate, self.safety, self.person
        )

    def sample(self, target: Target, pose: int, count: int, seed: int) -> Float[np.ndarray, "N 3"]:
        """Return points (N, 3) m in a target at a pose, denser where its weight field is larger.

        Raises:
            ValueError: as ``target_solid`` does, and if the target is empty.
        """
        return sample(self.solid(target, pose), count, seed, target.importance)

    def target_named(self, name: str, radius: float | None) -> Target:
        """Return the goal's target that records list under this key, or else the named volume.

        Raises:
            ValueError: if there is neither.
        """
        for goal in self.targets:
            if goal.key == (name, radius):
                return goal.target
        return named_target(name, radius)

    def limits_of(self, link: str) -> Limits:
        """Return the limits of ``link``."""
        return self.mounts.get(link, Limits())

    def sensor_of(self, link: str) -> Sensor:
        """Return the sensor of new rings on ``link``."""
        return self.limits_of(link).sensor or self.sensor

    @property
    def sensors(self) -> frozenset[Sensor]:
        """The different sensors that a setup of the scene may contain."""
        return frozenset((*self._of_rings, *(single.sensor for single in self.standing)))

    @property
    def _of_rings(self) -> tuple[Sensor, ...]:
        """The sensors that rings of the scene may have."""
        new = (self.sensor, *(self.sensor_of(link) for link in self.robot.links))
        return (*new, *(ring.sensor for ring in self.rules.fixed))

    @property
    def square(self) -> bool:
        """Whether rings of the scene may have other beams than cones from the apex on; single
        sensors do not matter here."""
        return not all(sensor.plain for sensor in self._of_rings)

    @property
    def real(self) -> bool:
        """Whether rings have bodies."""
        return self.rules.mount == "real"

    def least_radius(self, link: str) -> float:
        """Return the minimum radius of a ring on ``link``, m, rounded up to the next mm.

        It is the radius of the surrounded section plus the stand-off; 0 where rings have no bodies.
        """
        if not self.real:
            return 0.0
        return _up_to_mm(surrounded(self.robot, link) + self.rules.standoff)

    def stated_radius(self, link: str) -> float | None:
        """Return the radius that the scene states for rings on ``link``, m, if any."""
        of_link = self.limits_of(link).radius
        return self.ring_radius if of_link is None else of_link

    @property
    def default_radius(self) -> float:
        """The radius of new rings, m, before a real ring raises it."""
        return RING_RADIUS if self.ring_radius is None else self.ring_radius

    def radius_of(self, link: str) -> float:
        """Return the radius of a new ring on ``link``, m: the scene's, if it is stated.

        A radius that was not stated is raised to the minimum, and until the ring's boards clear the
        link at every allowed tilt.
        """
        stated = self.stated_radius(link)
        return max(RING_RADIUS, self.smallest_radius(link)) if stated is None else stated

    def smallest_radius(self, link: str) -> float:
        """Return the smallest radius of a ring on ``link``, m, whose boards clear the link at every
        allowed tilt; 0 where rings have no bodies."""
        return max(self.least_radius(link), self._roomy(link))

    def _roomy(self, link: str) -> float:
        if not self.real:
            return 0.0
        board = self.sensor_of(link).board or NOMINAL
        around = surrounded(self.robot, link)
        return _up_to_mm(roomy_radius(board, self.printing, around, self.limits_of(link).tilt))

    def price_of(self, setup: Setup) -> SetupPrice | None:
        """Return the price of a setup; None without prices."""
        if self.prices is None:
            return None
        fixed = (*self.rules.fixed, *self.rules.fixed_sensors)
        return self.prices.of_setup(setup, fixed)

    @property
    def pose_weights(self) -> Float[np.ndarray, " P"]:
        """Weights of the poses, summing to 1."""
        weight = np.array([p.weight for p in self.poses], float)
        share: np.ndarray = weight / weight.sum()
        return share

    @property
    def goal_weights(self) -> Float[np.ndarray, " G"]:
        """Weights of the goals, summing to 1."""
        weight = np.array([g.weight for g in self.targets], float)
        share: np.ndarray = weight / weight.sum()
        return share


def _up_to_mm(length: float) -> float:
    """Return a length, m, rounded up to the next mm."""
    return math.ceil(1000 * length - 1e-6) / 1000


def as_in_paper(scene: Scene) -> Scene:
    """Return ``scene`` in the paper's world: transparent bodies, and rings without bodies that sit
    on the lines between the joints."""
    return replace(scene, occlusion="ignore", rules=replace(scene.rules, mount="free"))


def _of_robot(robot: Robot, stated: dict[str, Any]) -> dict[str, Any]:
    """Return what a scene states, with the defaults that depend on its robot."""
    if not robot.bodies:
        stated = {"occlusion": "ignore"} | stated
    if robot_key(robot) not in PAPER_ROBOTS:
        stated = {"poses": poses_of(robot, Pose(robot.rest))} | stated
    return stated
