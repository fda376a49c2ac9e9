"""A scene: what is asked. Robot, poses with weights, targets with weights, sensor, mount limits."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.ring import RING_RADIUS, Ring
from ..coverage.robots.built_in import UR10
from ..coverage.robots.ring_section import surrounded
from ..coverage.robots.robot import Robot
from ..coverage.robots.separation_distance import Safety
from ..coverage.sensors.board_packing import Printing, roomy_radius
from ..coverage.sensors.sensor import PAPER_SENSOR, Sensor
from ..coverage.solids.base import Difference
from ..coverage.solids.polyhedra import Polyhedron
from ..coverage.targets import Shape, Target, target_solid

REFERENCE_POSE_DEG = (0.0, -45.0, 60.0, -105.0, -90.0, 0.0)
_REFERENCE_POSE = np.radians(REFERENCE_POSE_DEG)
_REFERENCE_POSE.setflags(write=False)  # the default of every scene


@dataclass(frozen=True)
class Pose:
    """Joint angles q (J,) rad, the weight of the pose in the mean, when a record was there, s, if
    it is from one, and the joints' speeds ``rate`` (J,) rad/s, where they are known."""

    q: Float[np.ndarray, " J"]
    weight: float = 1.0
    time_s: float | None = None
    rate: Float[np.ndarray, " J"] | None = None


@dataclass(frozen=True)
class Recorded:
    """Where a scene's poses come from: the file of a recorded motion, its rows and seconds, the
    largest distance in any joint of a recorded sample from its pose, rad, and by how much speed
    added to weights."""

    file: str
    rows: int
    seconds: float
    within: float
    speed_weight: float


OverPoses = Literal["mean", "worst"]
Mounting = Literal["real", "free"]


@dataclass(frozen=True)
class Goal:
    """A target volume, its weight in the objective (0: none), and the zeta in [0, 1] that it shall
    have at least.
    """

    target: Target
    weight: float = 1.0
    at_least: float = 0.0


@dataclass(frozen=True)
class Limits:
    """Where rings may sit on a link and how they may tilt: position (low, high) on its mount axis,
    intervals within that are kept free of rings, tilt (low, high) rad; and the sensor and the
    radius, m, of its rings, if not the scene's."""

    position: tuple[float, float] = (0.0, 1.0)
    tilt: tuple[float, float] = (math.radians(-70), math.radians(70))
    keep_out: tuple[tuple[float, float], ...] = ()
    sensor: Sensor | None = None
    radius: float | None = None


@dataclass(frozen=True)
class Rules:
    """What makes a setup buildable: least distance of two rings on a link, m, and of a ring from
    the link's ends, m; least and most sensors of a ring; most rings on a link; whether all rings
    have one tilt, up to its sign; and rings that are there and stay.

    mount: ``real``: a ring has a body, which clears its link by ``standoff`` m (from what is
    surrounded to the sensors), stays within what is usable of the link, and lies in no body and no
    obstacle at any pose; ``free``: it has none; where nothing is said, real unless the robot's own
    body is ignored. band: the body's thickness, across the axis, and its width along it, m.
    """

    spacing: float = 0.03
    from_joints: float = 0.0
    sensors: tuple[int, int] = (3, 24)
    rings_per_link: int = 8
    shared_tilt: bool = False
    fixed: tuple[Ring, ...] = ()
    mount: Mounting | None = None
    standoff: float = 0.012
    band: tuple[float, float] = (0.01, 0.02)

    @property
    def arm(self) -> float:
        """How far a ring's body reaches along its axis to either side of its circle before it is
        rounded off, m.
        """
        return max(self.band[1] - self.band[0], 0.0) / 2


@dataclass(frozen=True)
class Obstacle:
    """A convex thing of the cell: its name, its body in the base frame, the keys of a scene's file
    that make it, and whether it is the hull of something that is not convex."""

    name: str
    body: Polyhedron
    keys: dict[str, Any] = field(default_factory=dict)
    hulled: bool = False


@dataclass(frozen=True)
class Motion:
    """How a real robot may be moved for a check, and what stops it."""

    speed: float = math.radians(15)
    """rad/s, of the leading joint."""
    acceleration: float = math.radians(30)
    """rad/s², likewise."""
    near: float = 0.15
    """m; a nearer reading stops the robot."""
    own: float = 0.04
    """m, that its bodies keep from each other."""
    cell: float = 0.1
    """m, that its bodies keep from obstacles."""
    near_share: float = 0.5
    """Least share of the sensors, along the route, that must keep the whole of ``near``."""
    failed_share: float = 0.25
    """Share of a ring's sensors that may report failure."""
    frozen_frames: int = 6
    """Consecutive frames in which a ring's distances may stay as they are while the robot moves."""
    cell_complete: bool = False
    """Whether everything the robot can reach stands in the scene."""
    rings_as_proposed: bool = False
    """Whether every ring is known to be wired and mounted the right way round."""


@dataclass(frozen=True)
class Scene:
    """The empty scene is the reference scene: a UR10 in one pose, V_S(0.5), the paper's sensor and
    ring radius.

    limits: of each link by name; a link that is not named has the default limits. over_poses:
    whether the weighted mean over the poses or the worst of them is to be large. occlusion: what
    the robot's own body does to its sensors; obstacles shadow in any case, and are no part of a
    target. radius_stated: ``ring_radius`` is meant, and not raised where a real ring needs more.
    safety: what the distances of V_P are made of. motion: how a real robot may be moved. printing:
    how rings are made.
    """

    robot: Robot = UR10
    poses: tuple[Pose, ...] = (Pose(_REFERENCE_POSE),)
    goals: tuple[Goal, ...] = (Goal(Target("V_S", 0.5)),)
    sensor: Sensor = PAPER_SENSOR
    ring_radius: float = RING_RADIUS
    shape: Shape = field(default_factory=Shape)
    limits: dict[str, Limits] = field(default_factory=dict)
    rules: Rules = field(default_factory=Rules)
    over_poses: OverPoses = "mean"
    recorded: Recorded | None = None
    occlusion: Occlusion = "ignore"
    obstacles: tuple[Obstacle, ...] = ()
    safety: Safety = field(default_factory=Safety)
    motion: Motion = field(default_factory=Motion)
    radius_stated: bool = False
    printing: Printing = field(default_factory=Printing)

    def solid(self, target: Target, pose: int) -> Difference:
        """The target volume at a pose, less V_R and the obstacles; ValueError as for
        ``target_solid``.
        """
        at, stands = self.poses[pose], tuple(o.body for o in self.obstacles)
        return target_solid(target, self.robot, at.q, self.shape, stands, at.rate, self.safety)

    def limits_of(self, link: str) -> Limits:
        """The limits of ``link``."""
        return self.limits.get(link, Limits())

    def sensor_of(self, link: str) -> Sensor:
        """The sensor of new rings on ``link``."""
        return self.limits_of(link).sensor or self.sensor

    @property
    def square(self) -> bool:
        """May a setup of the scene have sensors with square beams?"""
        sensors = (self.sensor, *(self.sensor_of(link) for link in self.robot.links))
        return any(s.square for s in (*sensors, *(r.sensor for r in self.rules.fixed)))

    @property
    def real(self) -> bool:
        """Do rings have bodies?"""
        return (self.rules.mount or ("free" if self.occlusion == "ignore" else "real")) == "real"

    def least_radius(self, link: str) -> float:
        """The least radius of a ring on ``link``, m, up to the next mm: of what it surrounds, and
        the stand-off; 0 where rings have no bodies."""
        if not self.real:
            return 0.0
        around = surrounded(self.robot.mount(link), self.robot.bodies)
        return math.ceil(1000 * (around + self.rules.standoff) - 1e-6) / 1000

    def stated_radius(self, link: str) -> float | None:
        """The radius that the scene states for rings on ``link``, m, if any."""
        of_link = self.limits_of(link).radius
        return self.ring_radius if of_link is None and self.radius_stated else of_link

    def radius_of(self, link: str) -> float:
        """The radius of a new ring on ``link``, m: the scene's; one that was not stated is raised
        to the least, and to where its boards clear the link at every tilt that is allowed."""
        stated = self.stated_radius(link)
        return (
            max(self.ring_radius, self.least_radius(link), self._roomy(link))
            if stated is None
            else stated
        )

    def _roomy(self, link: str) -> float:
        board = self.sensor_of(link).board
        if board is None or not self.real:
            return 0.0
        around = surrounded(self.robot.mount(link), self.robot.bodies)
        return (
            math.ceil(
                1000 * roomy_radius(board, self.printing, around, self.limits_of(link).tilt) - 1e-6
            )
            / 1000
        )

    @property
    def spacing(self) -> float:
        """Least distance of two rings on a link, m: real ones do not overlap."""
        return max(self.rules.spacing, self.rules.band[1]) if self.real else self.rules.spacing

    @property
    def pose_weights(self) -> Float[np.ndarray, " P"]:
        """Weights of the poses, summing to 1."""
        weight = np.array([p.weight for p in self.poses], float)
        share: np.ndarray = weight / weight.sum()
        return share

    @property
    def goal_weights(self) -> Float[np.ndarray, " G"]:
        """Weights of the goals, summing to 1."""
        weight = np.array([g.weight for g in self.goals], float)
        share: np.ndarray = weight / weight.sum()
        return share
