"""Model of the limits of a check's links to the robot and its rings."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from ...objectives.link_limits import LinkLimits
from .base_model import refuse
from .mapping import MappedModel, Of

_FEWEST = 3  # states within state_stale_s: a single one that is late or lost is no fault


class LinkLimitsModel(MappedModel[LinkLimits]):
    """Limits of a check's links to the robot and its rings; times until the robot is stopped. They
    are no safety function."""

    rate_hz: Annotated[float, Of("rate")] = Field(
        default=LinkLimits.rate, ge=50, le=500, description="states of the robot per second, Hz"
    )
    state_stale_s: Annotated[float, Of("state_stale")] = Field(
        default=LinkLimits.state_stale,
        ge=0.01,
        le=0.5,
        description="age or delay of a state of the robot that stops it, s",
    )
    ring_silent_s: Annotated[float, Of("ring_silent")] = Field(
        default=LinkLimits.ring_silent,
        ge=0.1,
        le=1,
        description="time without a frame of a ring that stops the robot, s",
    )
    ring_late_s: Annotated[float, Of("ring_late")] = Field(
        default=LinkLimits.ring_late,
        ge=0.01,
        le=0.5,
        description="delay beyond which a frame of a ring is not used, s",
    )
    sign_of_life_s: Annotated[float, Of("sign_of_life")] = Field(
        default=LinkLimits.sign_of_life,
        ge=0.05,
        le=0.5,
        description="time for which the check's programs may be silent during a motion, s",
    )
    watchdog_s: Annotated[float, Of("watchdog")] = Field(
        default=LinkLimits.watchdog,
        ge=0.05,
        le=0.5,
        description="time without a sign of life after which the robot ends its program, s",
    )

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        """Refuse limits that would end every check: no two states and no two frames in time."""
        least, faults = _FEWEST / self.rate_hz, []
        if self.state_stale_s < least:
            allowed = f"at least {_FEWEST} states at rate_hz = {self.rate_hz:g}: {least:.3g} s"
            faults.append((("state_stale_s",), self.state_stale_s, allowed))
        if self.ring_late_s > self.ring_silent_s:
            allowed = f"at most ring_silent_s = {self.ring_silent_s:g}"
            faults.append((("ring_late_s",), self.ring_late_s, allowed))
        refuse(faults)
        return self
