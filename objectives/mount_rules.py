"""Rules that make a setup buildable, and limits of rings by link."""

import math
import warnings
from typing import Annotated, Any, Literal

from pydantic import Field

from ..coverage.definitions.definition import Fault, definition, refuse
from ..coverage.definitions.field_types import Items, Pair
from ..coverage.definitions.units import ELSEWHERE, Degrees, Key, degrees
from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring
from ..coverage.sensors.sensor import Sensor

Mounting = Literal["real", "free"]
_Position = Annotated[
    float, Field(ge=0, le=1, description="position along the link, from 0 proximal to 1 distal")
]
_Degrees = Annotated[float, Degrees("tilt_deg", gt=-90, lt=90)]
_FORMER = "rings_per_link"  # a command's option of that name sets a number, not a maximum


@definition
class Limits:
    """Where rings may sit on a link, how far they may tilt, and which sensors they carry."""

    position: Pair[_Position] = (0.0, 1.0)
    """Lowest and highest position on the mount axis, from 0 proximal to 1 distal."""
    tilt: Pair[_Degrees] = (math.radians(-70), math.radians(70))
    """Lowest and highest tilt, rad, positive towards the distal end."""
    keep_out: Annotated[Items[Pair[_Position]], Field(max_length=100)] = ()
    """Intervals of position without rings, from 0 proximal to 1 distal."""
    sensor: Sensor | None = None
    """Sensor of rings on this link; default: the scene's."""
    radius: Annotated[float, Key("ring_radius", gt=0, le=1)] | None = None
    """Radius of rings on this link, m; default: the scene's."""

    def __post_init__(self) -> None:
        """Refuse intervals whose first value is the higher."""
        low, high = self.tilt
        pairs: dict[tuple[int | str, ...], tuple[float, float]] = {
            ("position",): self.position,
            ("tilt_deg",): (degrees(low), degrees(high)),
            **{("keep_out", i): pair for i, pair in enumerate(self.keep_out)},
        }
        refuse(_descending(pairs))


@definition
class Rules:
    """Rules that make a setup buildable."""

    spacing: Annotated[float, Field(ge=0, le=10)] = 0.03
    """Least distance between two rings on a link, m."""
    from_joints: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Least distance of a ring from the link's ends, m."""
    sensors: Pair[Annotated[int, Key("sensors_per_ring", ge=1, le=1000)]] = (3, 24)
    """Fewest and most sensors of a ring."""
    max_rings_per_link: Annotated[int, Field(ge=1, le=200)] = 8
    """Largest number of rings on a link."""
    shared_tilt: bool = False
    """Whether all rings but fixed ones have the same tilt, up to its sign."""
    fixed: Annotated[Items[Ring], ELSEWHERE] = ()
    """Existing rings, which stay in place."""
    fixed_sensors: Annotated[Items[MountedSensor], ELSEWHERE] = ()
    """Existing single sensors on the robot, which stay in place."""
    mount: Mounting = "real"
    """real: rings have envelopes, which stay within the usable part of the link and keep the
    clearance at every pose, and sensors keep the standoff; free: they have no body, as in the
    paper; default without bodies of the robot: free."""
    standoff: Annotated[float, Field(ge=0, le=1)] = 0.012
    """Least distance from the surface that a ring surrounds to its sensors, m."""
    clearance: Annotated[float, Field(ge=0, le=1)] = 0.002
    """Least distance of a ring's envelope from obstacles, other rings, and bodies except the tube
    that it grips, m: only the print's slack is between these."""

    def __post_init__(self) -> None:
        """Refuse fewer sensors at most than at least."""
        refuse(_descending({("sensors_per_ring",): self.sensors}))

    @classmethod
    def _of_table(cls, table: dict[str, Any]) -> dict[str, Any]:
        """Read the former name of ``max_rings_per_link``."""
        if _FORMER in table and "max_rings_per_link" not in table:
            message = f"rules: {_FORMER} is now called max_rings_per_link"
            warnings.warn(message, DeprecationWarning, stacklevel=2)
            table["max_rings_per_link"] = table.pop(_FORMER)
        return table


def _descending(pairs: dict[tuple[int | str, ...], tuple[float, float]]) -> list[Fault]:
    """Return the pairs, by their keys, whose first value is the higher."""
    return [
        (key, f"{list(pair)}", "the lower value first")
        for key, pair in pairs.items()
        if pair[0] > pair[1]
    ]
