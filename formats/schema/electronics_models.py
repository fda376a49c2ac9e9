"""Model of the electronics of rings."""

from pydantic import Field

from ...coverage.electronics.controllers import DEFAULT_CONTROLLER, ControllerName
from ...coverage.electronics.electronics import MOST_HZ, Bus, Electronics
from ...coverage.electronics.ring_bus import LEAST_HZ, USUAL_HZ
from .mapping import MappedModel


class ElectronicsModel(MappedModel[Electronics]):
    """How the sensors of each ring are read; they limit the number of sensors on a ring."""

    rate_hz: int | None = Field(
        default=None,
        ge=LEAST_HZ,
        le=MOST_HZ,
        description=f"readings of every sensor per second; default: at most {USUAL_HZ}, as many as"
        " sensor and bus allow",
    )
    bus: Bus = Field(
        default="auto",
        description="how the sensors of a ring share its bus: each XSHUT on a pin, each sensor on a"
        " channel of a multiplexer, the first of both that works, or by electronics of your own,"
        " which limit nothing",
    )
    controller: ControllerName = Field(
        default=DEFAULT_CONTROLLER, description="controller board of each ring"
    )
