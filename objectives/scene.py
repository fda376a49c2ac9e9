"""A scene: robot, weighted poses, weighted target volumes, sensor, mount limits and rules."""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import FARTHEST
from ..coverage.electronics.electronics import Electronics
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.person_reach import Person
from ..coverage.rings.mounted_sensor import BASE_LINK, MountedSensor
from ..coverage.rings.ring import RING_RADIUS, Setup
from ..coverage.robots.attached import GIVEN_SOLID, ConvexSolid, named, refuse_file
from ..coverage.robots.built_in import UR10
from ..coverage.robots.ring_section import surrounded
from ..coverage.robots.robot import Robot
from ..coverage.robots.separation_distance import Safety
from ..coverage.sensors.board_packing import Printing, roomy_radius
from ..coverage.sensors.boards import NOMINAL
from ..coverage.sensors.sensor import PAPER_SENSOR, Sensor
from ..coverage.soft.sampling import sample
from ..coverage.solids.base import Difference
from ..coverage.solids.polyhedra import Polyhedron, half_space
from ..coverage.targets.named import Shell, named_target
from ..coverage.targets.posed_robot import Shape
from ..coverage.targets.solid import target_solid
from ..coverage.targets.target import Target
from .link_limits import LinkLimits
from .motion_limits import Motion
from .mount_rules import Limits, Rules
from .poses import Pose, Recorded
from .prices import Prices, SetupPrice

REFERENCE_POSE_DEG = (0.0, -45.0, 60.0, -105.0, -90.0, 0.0)
_REFERENCE_POSE = np.radians(REFERENCE_POSE_DEG)
_REFERENCE_POSE.setflags(write=False)  # the default of every scene


OverPoses = Literal["mean", "worst"]


@definition
class Obstacle(ConvexSolid):
    """A convex obstacle of the cell. It occludes sensors and is excluded from targets.

    It is a box (``size``), the convex hull of ``points``, the half-space below a ``floor``, or in a
    scene's file the mesh in a ``file``. ``centre`` and ``rpy_deg`` (rotations about x, then y, then
    z of the base frame) place all but the floor.

    Example:
        >>> import place_rings as pr
        >>> pr.Obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2]).name
        'table'
    """

    kinds = (*ConvexSolid.kinds, "floor")
    floor: Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)] | None = field(
        default=None, kw_only=True
    )
    """Height of the floor, m; the obstacle is everything below."""
    body: Annotated[Polyhedron, *GIVEN_SOLID] = field(default=None, repr=False, compare=False)  # type: ignore[assignment]
    """Its shape in the base frame: follows from the other arguments, or stands in their place."""

    def __post_init__(self) -> None:
        if self.body is not None and not any(getattr(self, key) is not None for key in self.kinds):
            return
        body = self._polyhedron()
        if self.floor is not None:
            object.__setattr__(self, "name", self.name or "floor")
            body = half_space(self.floor)
        object.__setattr__(self, "body", body)


@dataclass(frozen=True)
class Scene:
    """A scene. The default is the reference scene: a UR10 in one pose, V_S(0.5), the sensor of the
    paper, real mounts and self-occlusion. ``paper_scene`` gives the scene of the paper.

    A robot without bodies occludes nothing, and rings on it have no bodies either: whatever is
    stated, ``occlusion`` is then ``ignore`` and ``rules.mount`` is ``free``.
    """

    robot: Robot = UR10
    """The robot arm."""
    poses: tuple[Pose, ...] = (Pose(_REFERENCE_POSE),)
    """The weighted poses."""
    targets: tuple[Target, ...] = (Shell(0.5),)
    """The weighted target volumes."""
    sensor: Sensor = PAPER_SENSOR
    """The sensor of new rings."""
    ring_radius: float = RING_RADIUS
    """Radius of new rings, m."""
    curve: Shape = field(default_factory=Shape)
    """How target volumes are built."""
    mounts: dict[str, Limits] = field(default_factory=dict)
    """Limits by link name; links that are not named have the default limits."""
    rules: Rules = field(default_factory=Rules)
    """Rules that make a setup buildable."""
    over_poses: OverPoses = "mean"
    """Whether to maximise the weighted mean over the poses or the worst pose."""
    recorded: Recorded | None = None
    """The recorded motion from which the poses come, if any."""
    occlusion: Occlusion = "shadow"
    """How the robot's own body occludes its sensors. Obstacles always occlude."""
    obstacles: tuple[Obstacle, ...] = ()
    """Obstacles of the cell; they are never part of a target."""
    cell_sensors: tuple[MountedSensor, ...] = ()
    """Sensors of the cell, all on the link ``base``; they cover what they see, with any setup."""
    safety: Safety = field(default_factory=Safety)
    """Terms of the separation distances of V_P."""
    motion: Motion = field(default_factory=Motion)
    """How a real robot may move during a check."""
    link: LinkLimits = field(default_factory=LinkLimits)
    """Limits of a check's links to the robot and its rings."""
    radius_stated: bool = False
    """Whether ``ring_radius`` was stated; if so, it is not raised where a real ring needs more."""
    base_stated: bool = field(default=False, compare=False)
    """Whether it was stated in which base frame the coordinates are; they are in the robot's own,
    into which others are turned when they are read."""
    printing: Printing = field(default_factory=Printing)
    """How rings are printed."""
    electronics: Electronics = field(default_factory=Electronics)
    """How the sensors of each ring are read."""
    prices: Prices | None = None
    """What rings and sensors cost, if known."""
    person: Person | None = None
    """Where people walk and how far they reach, if stated."""

    def __post_init__(self) -> None:
        """Put the links into use that the rules ask for; a robot without bodies has free mounts.

        Raises:
            ValueError: if a sensor of the cell is on another link than ``base``.
        """
        if not self.robot.bodies:
            object.__setattr__(self, "occlusion", "ignore")
            object.__setattr__(self, "rules", replace(self.rules, mount="free"))
        object.__setattr__(self, "obstacles", named(self.obstacles, "obstacle"))
        object.__setattr__(self, "robot", self.robot.with_links(self.real))
        if self.robot.chain.mimics:
            object.__setattr__(self, "poses", tuple(map(self._settled, self.poses)))
        for solid in self.obstacles:
            refuse_file(solid)
        for i, one in enumerate(self.cell_sensors):
            if one.link != BASE_LINK:
                raise ValueError(
                    f"cell_sensors[{i}].link: found {one.link!r}, allowed: {BASE_LINK}; a sensor"
                    " on the robot belongs to a setup or to the fixed sensors of the rules"
                )

    def _settled(self, pose: Pose) -> Pose:
        """Return the pose with the values of mimic joints that their leaders state."""
        chain = self.robot.chain
        rate = None if pose.rate is None else chain.settled(np.asarray(pose.rate), speed=True)
        return replace(pose, q=chain.settled(np.asarray(pose.q)), rate=rate)

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
        new = (self.sensor, *(self.sensor_of(link) for link in self.robot.links))
        fixed = (r.sensor for r in self.rules.fixed)
        return frozenset((*new, *fixed, *(one.sensor for one in self.standing)))

    @property
    def square(self) -> bool:
        """Whether rings of the scene may have other beams than cones from the apex on; single
        sensors do not matter here."""
        new = (self.sensor, *(self.sensor_of(link) for link in self.robot.links))
        return not all(s.plain for s in (*new, *(r.sensor for r in self.rules.fixed)))

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
        around = surrounded(self.robot, link)
        return math.ceil(1000 * (around + self.rules.standoff) - 1e-6) / 1000

    def stated_radius(self, link: str) -> float | None:
        """Return the radius that the scene states for rings on ``link``, m, if any."""
        of_link = self.limits_of(link).radius
        return self.ring_radius if of_link is None and self.radius_stated else of_link

    def radius_of(self, link: str) -> float:
        """Return the radius of a new ring on ``link``, m: the scene's, if it is stated.

        A radius that was not stated is raised to the minimum, and until the ring's boards clear the
        link at every allowed tilt.
        """
        stated = self.stated_radius(link)
        return max(self.ring_radius, self.smallest_radius(link)) if stated is None else stated

    def smallest_radius(self, link: str) -> float:
        """Return the smallest radius of a ring on ``link``, m, whose boards clear the link at every
        allowed tilt; 0 where rings have no bodies."""
        return max(self.least_radius(link), self._roomy(link))

    def _roomy(self, link: str) -> float:
        if not self.real:
            return 0.0
        board = self.sensor_of(link).board or NOMINAL
        around = surrounded(self.robot, link)
        return (
            math.ceil(
                1000 * roomy_radius(board, self.printing, around, self.limits_of(link).tilt) - 1e-6
            )
            / 1000
        )

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


def as_in_paper(scene: Scene) -> Scene:
    """Return ``scene`` in the paper's world: transparent bodies, and rings without bodies that sit
    on the lines between the joints."""
    return replace(scene, occlusion="ignore", rules=replace(scene.rules, mount="free"))


def paper_scene(**fields: Any) -> Scene:
    """Return a scene with these fields of ``Scene``, in the paper's world."""
    return as_in_paper(Scene(**fields))
