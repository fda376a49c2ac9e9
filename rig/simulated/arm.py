"""Simulated arm: it moves to joint angles with the requested speed and acceleration, and stops."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from ruckig import (
    ControlInterface,
    InputParameter,
    OutputParameter,
    Result,
    Ruckig,
    Synchronization,
)

from ..robot.state import JOINTS

_JERK = 200.0  # rad/s³; no command specifies it
MOST_SPEED = 3.15  # rad/s, as in the real controller
MOST_ACCELERATION = 40.0  # rad/s²


@dataclass
class Arm:
    """Simulated arm."""

    q: Float[np.ndarray, " 6"]
    """Joint angles, rad."""
    step: float
    """Time step, s."""
    speed: Float[np.ndarray, " 6"] = field(default_factory=lambda: np.zeros(JOINTS))
    """Joint speeds, rad/s."""
    moving: bool = False
    """Whether the arm moves."""
    scaling: float = 1.0
    """Share of the requested speed, as the speed slider of the pendant sets it; 0 holds the arm."""

    def __post_init__(self) -> None:
        self._motion = Ruckig(JOINTS, self.step)
        self._now, self._next = InputParameter(JOINTS), OutputParameter(JOINTS)
        self._now.current_position = list(self.q)
        self._now.max_jerk = [_JERK] * JOINTS
        self._now.synchronization = Synchronization.Phase

    def move(self, q: Float[np.ndarray, " 6"], speed: float, acceleration: float) -> None:
        """Start a motion to ``q`` (6,) rad: all joints arrive together, the leading one with
        ``speed`` rad/s.
        """
        self._now.control_interface = ControlInterface.Position
        self._now.target_position, self._now.target_velocity = list(q), [0.0] * JOINTS
        self._set(speed, acceleration)

    def stop(self, deceleration: float) -> None:
        """Start to decelerate by ``deceleration`` rad/s² of the leading joint."""
        self._now.control_interface = ControlInterface.Velocity
        self._now.target_velocity = [0.0] * JOINTS
        self._set(MOST_SPEED, deceleration)

    def _set(self, speed: float, acceleration: float) -> None:
        self._now.max_velocity = [float(np.clip(speed, 1e-3, MOST_SPEED))] * JOINTS
        self._now.max_acceleration = [
            float(np.clip(acceleration, 1e-2, MOST_ACCELERATION))
        ] * JOINTS
        self.moving = True

    def tick(self) -> None:
        """Advance by one time step."""
        if not self.moving or self.scaling <= 0:
            self.speed = np.zeros(JOINTS)
            return
        self._motion.delta_time = self.step * self.scaling  # of the motion's own time
        result = self._motion.update(self._now, self._next)
        if result not in (Result.Working, Result.Finished):
            raise RuntimeError(f"the simulated arm cannot go there: {result}")
        self._next.pass_to_input(self._now)
        self.q = np.array(self._next.new_position)
        self.speed = self.scaling * np.array(self._next.new_velocity)
        self.moving = result == Result.Working
        if not self.moving:
            self.speed = np.zeros(JOINTS)
