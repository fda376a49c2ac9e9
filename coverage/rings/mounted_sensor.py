"""A single sensor: a pose on a link's frame, or on the robot's base, and its own beam."""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, ValidationError
from pydantic_core import InitErrorDetails, core_schema

from ..arrays import cross
from ..definitions.definition import InputError, adapter, definition, refuse
from ..definitions.field_types import FARTHEST, Point, Text, Triple
from ..definitions.units import OF_SCENE, Absent, Millimetres
from ..sensors.sensor import PAPER_SENSOR, Sensor

BASE_LINK = "base"
"""Name of the robot's base frame, to which sensors of the cell are fixed."""
_KEYS = ("name", "position", "direction", "up", "sensor", "link", "lifted_mm")
_OF_ROBOT = {"link", "lifted_mm"}  # keys that a sensor of the cell has not
_PARALLEL = 1e-6  # least sine of the angle between direction and up
_Vector = Triple[Annotated[float, Field(ge=-1e6, le=1e6, description="component of a vector")]]


@definition
class MountedSensor:
    """A sensor anywhere on the robot or, on the link ``base``, in its cell.

    To ring kinematics it is a ring of one sensor, of radius 0, whose mount is the sensor's own
    frame: the mount's axis is ``up``, and its zero direction is the beam's.
    """

    link: Text
    """Link that carries it: a link with a mount, a joint (the link that it moves), tcp, or base."""
    position: Point
    """Apex of the beam in the frame of that link, m."""
    direction: _Vector
    """Axis of the beam in that frame, a vector of any length."""
    sensor: Annotated[Sensor, Absent(OF_SCENE)] = PAPER_SENSOR
    """The sensor, with its beam; in a file by default the scene's."""
    up: _Vector | None = None
    """Direction across the axis along which fov_up is measured; necessary unless the beam is
    round."""
    name: Text = ""
    """Name for messages; may be empty."""
    lifted: Annotated[float, Millimetres("lifted_mm", ge=0, le=1000 * FARTHEST)] = 0.0
    """Distance by which it was moved along its axis out of the body in which it lay, m; position is
    the place after that."""

    count: ClassVar[int] = 1
    tilt: ClassVar[float] = 0.0
    phase: ClassVar[float] = 0.0
    radius: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        up, long = self.up, math.hypot(*self.direction)
        if not long > 0:
            refuse([(("direction",), f"{[*self.direction]}", "a vector other than 0")])
        if up is None and self.sensor is not OF_SCENE and self.sensor.oriented:
            allowed = "the direction of fov_up, because the beam is not round"
            refuse([(("up",), None, allowed)])
        if up is not None:
            across = np.linalg.norm(np.cross(up, self.direction))
            if not across > _PARALLEL * math.hypot(*up) * long:
                refuse([(("up",), f"{[*up]}", "a vector not parallel to the direction")])

    def _as_table(self, table: dict[str, Any]) -> dict[str, Any]:
        """Return a table with its keys in the order of files."""
        return {key: table[key] for key in _KEYS if key in table}

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
            line = f"found {T.shape}, allowed: shape (4, 4)"
            raise InputError(line, "MountedSensor: T_link_sensor")
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


class _OfCell:
    """Annotation of a sensor that files state without its link, the base, and with its beam."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        def read(value: Any, checked: Any) -> Any:
            if not isinstance(value, dict):
                return checked(value)
            kinds = [("extra_forbidden", key) for key in value if key in _OF_ROBOT]
            kinds += [("missing", "sensor")] if "sensor" not in value else []
            if kinds:
                faults = [InitErrorDetails(type=t, loc=(k,), input=value.get(k)) for t, k in kinds]
                raise ValidationError.from_exception_data("file", faults)
            return checked({**value, "link": BASE_LINK})

        def write(value: Any, written: Any) -> dict[str, Any]:
            return {key: v for key, v in written(value).items() if key not in _OF_ROBOT}

        inner = handler(source)
        return core_schema.no_info_wrap_validator_function(
            read,
            inner,
            serialization=core_schema.wrap_serializer_function_ser_schema(write, schema=inner),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        whole = handler(adapter(MountedSensor).core_schema)  # it may be visited before the class
        table = dict(handler.resolve_ref_schema(whole))
        table["properties"] = {k: v for k, v in table["properties"].items() if k not in _OF_ROBOT}
        table["properties"]["sensor"] = table["properties"]["sensor"]["anyOf"][0]
        table["required"] = ["position", "direction", "sensor"]
        return table


CellSensor = Annotated[MountedSensor, _OfCell()]
"""A sensor of the cell, fixed in the base frame: a camera, a scanner, a distance sensor."""
