"""A single sensor: a pose on a link's frame, or on the robot's base, and its own beam."""

import math
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar, Self

import numpy as np
from jaxtyping import Float

from ..arrays import cross
from ..sensors.sensor import PAPER_SENSOR, Sensor

BASE_LINK = "base"
"""Name of the robot's base frame, to which sensors of the cell are fixed."""
_PARALLEL = 1e-6  # least sine of the angle between direction and up
Three = tuple[float, float, float]


@dataclass(frozen=True)
class MountedSensor:
    """A sensor anywhere on the robot or, on the link ``base``, in its cell.

    To ring kinematics it is a ring of one sensor, of radius 0, whose mount is the sensor's own
    frame: the mount's axis is ``up``, and its zero direction is the beam's.
    """

    link: str
    """Link whose frame carries it: a link with a mount, a joint (the link that it moves), ``tcp``
    or ``base``."""
    position: Three
    """Apex of the beam in that frame, m."""
    direction: Three
    """Axis of the beam in that frame, of any length above 0."""
    sensor: Sensor = field(default=PAPER_SENSOR)
    """The sensor, with its beam."""
    up: Three | None = None
    """Direction across the axis along which ``fov_up`` is measured; the part along the axis is
    ignored. None: any, which only a round beam allows."""
    name: str = ""
    """Name for messages; may be empty."""
    lifted: float = 0.0
    """Distance, m, by which it was moved along its axis to the surface of the body in which it
    lay; ``position`` is the place after that."""

    count: ClassVar[int] = 1
    tilt: ClassVar[float] = 0.0
    phase: ClassVar[float] = 0.0
    radius: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        """Turn arrays into tuples; reject values outside their range with a ``ValueError``."""
        for key in ("link", "name"):
            if not isinstance(getattr(self, key), str):
                raise _fault(key, getattr(self, key), "text")
        if not isinstance(self.sensor, Sensor):
            raise _fault("sensor", self.sensor, "a Sensor, as a catalogue has them")
        for key in ("position", "direction", "up"):
            if key != "up" or self.up is not None:
                object.__setattr__(self, key, _three(key, getattr(self, key)))
        if not math.hypot(*self.direction) > 0:
            raise _fault("direction", self.direction, "a vector other than 0")
        if self.up is None and self.sensor.oriented:
            raise _fault("up", None, "the direction of fov_up, because the beam is not round")
        if self.up is not None:
            across = np.linalg.norm(np.cross(self.up, self.direction))
            if not across > _PARALLEL * math.hypot(*self.up) * math.hypot(*self.direction):
                raise _fault("up", self.up, "a vector not parallel to the direction")

    @classmethod
    def from_frame(
        cls,
        link: str,
        T_link_sensor: Float[np.ndarray, "4 4"],
        sensor: Sensor = PAPER_SENSOR,
        name: str = "",
    ) -> Self:
        """Return the sensor whose beam points along z of a frame, with ``up`` along its y.

        Args:
            link: as the field.
            T_link_sensor: pose of the sensor's frame in the link's, m.
            sensor: as the field.
            name: as the field.
        """
        T = np.asarray(T_link_sensor, float)
        if T.shape != (4, 4):
            raise _fault("T_link_sensor", T.shape, "shape (4, 4)")
        at, look, up = ((float(v[0]), float(v[1]), float(v[2])) for v in T[:3, [3, 2, 1]].T)
        return cls(link, at, look, sensor, up, name)

    @property
    def T_link_sensor(self) -> Float[np.ndarray, "4 4"]:
        """Pose (4, 4) m on the link: the beam points along z, and y is ``up``."""
        look = np.array(self.direction) / math.hypot(*self.direction)
        # the axis from which the beam points away most gives a round beam some direction up
        up = np.eye(3)[int(np.abs(look).argmin())] if self.up is None else np.array(self.up)
        up = up / np.linalg.norm(up)
        # subtracted even where it is rounding only, so that both are perpendicular
        up = up - (up @ look) * look
        up /= np.linalg.norm(up)
        T = np.eye(4)
        T[:3, :3] = np.stack([cross(up, look), up, look], axis=1)
        T[:3, 3] = self.position
        return T

    @property
    def label(self) -> str:
        """Name in messages."""
        return self.name or f"sensor on {self.link}"


def _fault(key: str, value: Any, allowed: str) -> ValueError:
    return ValueError(f"MountedSensor: {key}: found {value!r}, allowed: {allowed}")


def _three(key: str, value: Any) -> Three:
    """Return three finite numbers as a tuple."""
    numbers = value.tolist() if isinstance(value, np.ndarray) else value
    if not (
        isinstance(numbers, tuple | list)
        and len(numbers) == 3
        and all(isinstance(v, Real) and math.isfinite(v) for v in numbers)
    ):
        raise _fault(key, value, "three finite numbers")
    x, y, z = (float(v) for v in numbers)
    return x, y, z
