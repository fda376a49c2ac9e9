"""A twin of a setup in MuJoCo: it returns what the sensors would report."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from ...coverage.definitions.equality import equal_fields
from ...coverage.definitions.errors import InputError
from ...coverage.definitions.options import Number, Whole
from ...coverage.robots.kinematics import Chain
from ...formats.ring_status import ABSENT
from .arguments import axes, numbers
from .bodies import PlacedBody
from .frame_clock import FrameClock
from .look import Look
from .noise import Noise
from .world import TwinWorld

Mask = Literal["nothing", "robot", "scene"]
_MM = 1000
_DURATION = Number("s, 0 or more", ge=0)


@dataclass(frozen=True)
class TwinFrame:
    """The latest reading of each of K sensors that has arrived, with up to Z zones each."""

    time: Float[np.ndarray, " K"]
    """Moment of each sensor's measurement, s."""
    distance_mm: Float[np.ndarray, "K Z"]
    """Distance of each zone's first target, mm; nan without one."""
    status: Int[np.ndarray, "K Z"]
    """0: valid; 1: no target; 255: no such zone."""
    targets_mm: Float[np.ndarray, "K Z T"]
    """Distances of all targets of each zone, nearest first, mm; nan without one."""

    __eq__ = equal_fields


@dataclass(eq=False)
class SensorTwin:
    """A robot with rings of sensors in MuJoCo, which report as they would on the real robot.

    Sensors count ring by ring, then the single ones, then those of the cell; zones row by row as in
    a frame of their ring. A sensor measures once in its period. The frame arrives a period later,
    with random noise.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> twin = pr.twin("n1_8_0", bodies=[pr.Sphere(0.1)])
        >>> twin.put(0, (0.6, 0.0, 0.6))
        >>> for _ in range(3):
        ...     frame = twin.step(twin.q)
        >>> bool(np.nanmin(frame.distance_mm) > 0)
        True
    """

    world: TwinWorld
    chain: Chain
    """The scene's robot."""
    joints: Sequence[str]
    """Names of the robot's joints in the model."""
    names: tuple[str, ...]
    """Names of the K sensors, such as ``tof_0_3``; their sites in the model have them."""
    clock: FrameClock
    """When each sensor measures."""
    looks: Sequence[Look]
    masked: Bool[np.ndarray, " G"]
    """Which geoms block the view, but are not reported."""
    noise: Noise | None
    """Noise of the readings; None for exact ones."""
    bodies: Sequence[PlacedBody]
    """Bodies that can be put anywhere, where they are at first."""
    seed: int = 0
    own: bool = True
    """Whether the model is the scene's own, so that its keyframe is the pose."""
    _shown: "_Frames" = field(init=False, repr=False)  # that have arrived
    _taken: "_Frames" = field(init=False, repr=False)  # under way
    _number: Int[np.ndarray, " K"] = field(init=False, repr=False)  # of the latest measurement
    _now: float = field(init=False, repr=False)  # at the latest reading

    def __post_init__(self) -> None:
        """Start at the first pose."""
        ids = [self.model.joint(name).id for name in self.joints]
        self._qpos = self.model.jnt_qposadr[ids]
        self.reset(seed=self.seed)

    @property
    def model(self) -> Any:
        """The ``mujoco.MjModel``."""
        return self.world.model

    @property
    def data(self) -> Any:
        """The ``mujoco.MjData``; ``data.time`` is the time of the twin, s."""
        return self.world.data

    @property
    def q(self) -> Float[np.ndarray, " J"]:
        """Values of the robot's joints, rad or m."""
        q: np.ndarray = self.data.qpos[self._qpos]
        return q

    @property
    def dt(self) -> float:
        """The shortest period of a sensor, s."""
        return float(self.clock.period.min())

    def reset(self, q: Any = None, seed: int | None = None) -> TwinFrame:
        """Start again at time 0, as if everything had stood still before.

        Args:
            q: joint values (J,), rad or m; by default those of the scene's pose, or of the model.
            seed: seed of the noise; by default the noise goes on.

        Returns:
            The frame at that time.

        Raises:
            InputError: for other values.
        """
        import mujoco

        if seed is not None:
            Whole(0).check("seed", seed)
        if self.own:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        else:
            mujoco.mj_resetData(self.model, self.data)
        if q is not None:
            self._move(q)
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        for i, body in enumerate(self.bodies):
            self.world.put(i, body.centre, body.frame)
        self._start()
        return self.read()

    def step(self, q: Any, seconds: float | None = None) -> TwinFrame:
        """Let time pass, and put the robot at the joint values that it has then.

        Args:
            q: joint values (J,), rad or m.
            seconds: the time, s; by default the shortest period of a sensor.

        Returns:
            The latest readings that have arrived.

        Raises:
            InputError: for other values.
        """
        if seconds is not None:
            _DURATION.check("seconds", seconds)
        self._move(q)
        self.data.time += self.dt if seconds is None else seconds
        return self.read()

    def put(self, body: int, centre: Any, frame: Any = None) -> None:
        """Put a body at another place; the sensors see it there from their next measurement on.

        Args:
            body: number of the body.
            centre: centre (3,) in the world, m; the scene's own model has the twin's base frame.
            frame: its axes in columns (3, 3); by default it stays as it is turned.

        Raises:
            InputError: for other values.
        """
        if not self.bodies:
            raise InputError("found a number, allowed: none, as the twin has no bodies", "body")
        Whole(0, len(self.bodies) - 1).check("body", body)
        frame = None if frame is None else axes("frame", frame)
        self.world.put(body, numbers("centre", centre, (3,)), frame)

    def read(self) -> TwinFrame:
        """Let the sensors measure that are due at ``data.time``, where the model's joints and
        bodies are then.

        Returns:
            The latest readings that have arrived.
        """
        now = float(self.data.time)
        if now < self._now:  # the caller has reset the data
            self._start()
        self._now = now
        self._shown.take(self._taken, self.clock.arrived(self._taken.time, now))
        number = self.clock.number(now)
        due = number > self._number
        if due.any():
            self._taken.take(self._measured(due, self.clock.moment(number)), due)
        self._number = number
        return self._shown.frame()

    def _move(self, q: Any) -> None:
        self.data.qpos[self._qpos] = self.chain.settled(numbers("q", q, (len(self.joints),)))

    def _start(self) -> None:
        """Take a frame of all sensors that arrives now."""
        self._now = float(self.data.time)
        everyone, period = np.ones(len(self.names), bool), self.clock.period
        self._shown = self._measured(everyone, self._now - period)
        self._taken = _Frames(np.full(len(everyone), np.inf), *self._empty())
        self._number = self.clock.number(self._now - period / 2)

    def _empty(self) -> tuple[Float[np.ndarray, "K Z T"], Int[np.ndarray, "K Z T"]]:
        most = (max(look.zones for look in self.looks), max(look.targets for look in self.looks))
        shape = (len(self.names), *most)
        return np.full(shape, np.nan), np.full(shape, ABSENT)

    def _measured(self, due: Bool[np.ndarray, " K"], time: Float[np.ndarray, " K"]) -> "_Frames":
        """Return what the sensors that are due measure now, with noise."""
        frames = _Frames(time, *self._empty())
        self.world.place()
        for look in self.looks:
            if len(of := look.sensors[due[look.sensors]]):
                true = look.measured(look.distance(self.world, of, self.masked))
                distance, status = (self.noise or _EXACT).measured(self._rng, true)
                frames.distance[of, : look.zones, : look.targets] = distance
                frames.status[of, : look.zones, : look.targets] = status
        return frames


_EXACT = Noise(sigma=0.0, share=0.0, quantum=0.0, lost=0.0)


@dataclass
class _Frames:
    """Readings of all sensors."""

    time: Float[np.ndarray, " K"]
    distance: Float[np.ndarray, "K Z T"]
    status: Int[np.ndarray, "K Z T"]

    def take(self, others: "_Frames", some: Shaped[np.ndarray, " K"]) -> None:
        """Take the readings of some sensors."""
        self.time = np.where(some, others.time, self.time)
        self.distance = np.where(some[:, None, None], others.distance, self.distance)
        self.status = np.where(some[:, None, None], others.status, self.status)

    def frame(self) -> TwinFrame:
        """Return a copy in millimetres."""
        mm = self.distance * _MM
        return TwinFrame(self.time.copy(), mm[..., 0].copy(), self.status[..., 0].copy(), mm)
