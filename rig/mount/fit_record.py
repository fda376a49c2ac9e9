"""The estimated mounting of a ring as results, files and pages state it."""

import math
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ...formats.schema.base_model import StrictModel
from .channel_assignment import wiring_faults
from .mounting_error_model import LIMITS, NAMES
from .ring_fit import RingFit

_SHOWN: dict[str, tuple[float, Literal["mm", "°"]]] = {
    "slip": (1000.0, "mm"),
    "tilt": (180 / math.pi, "°"),
    "phase": (180 / math.pi, "°"),
    "offset": (1000.0, "mm"),
}
_DIGITS = 6


class ErrorModel(StrictModel):
    """Mounting error of a ring: the estimate, its 95 % margin, and for a simulated rig the injected
    error.
    """

    name: Literal["slip", "tilt", "phase", "offset"]
    unit: Literal["mm", "°"]
    value: float
    margin: float
    injected: float | None = None

    def __str__(self) -> str:
        return f"{self.name} {self.value:+.2f} ± {self.margin:.2f} {self.unit}"


class RingFitModel(StrictModel):
    """Mounting of a ring. ``verdict`` is ``differs`` if there are ``faults``; if there are none and
    the readings leave something ``open``, it is ``not determined``."""

    ring: int
    link: str
    verdict: Literal["as proposed", "differs", "not determined"]
    readings: int
    scale: float
    errors: list[ErrorModel]
    faults: list[str]
    open: list[str] = Field(description="what the readings do not determine, with the reason")
    misfits: dict[str, str] = Field(
        default={},
        description="what is mixed in grids of zones that fit no turn and no mirror, by sensor;"
        " then no errors are estimated",
    )
    region_holds: bool | None = Field(
        default=None, description="the joint region of 95 %, what was injected"
    )

    @property
    def text(self) -> list[str]:
        """What differs from the proposal or is left open, one line each."""
        return [f"ring {self.ring} ({self.link}): {line}" for line in (*self.faults, *self.open)]


def fit_of(
    number: int, fit: RingFit, injected: Float[np.ndarray, " 4"] | None = None
) -> RingFitModel:
    """Describe the estimated mounting of a ring, beside the errors that were injected."""
    truth = None if injected is None or not fit.names else truth_of(fit, injected)
    columns = [fit.values, fit.margins(), *([] if truth is None else [truth])]
    errors = []
    for name, row in zip(fit.names, np.transpose(columns).tolist(), strict=True):
        scale, unit = _SHOWN[name]
        shown = dict(zip(("value", "margin", "injected"), row, strict=False))
        shown = {key: round(scale * value, _DIGITS) for key, value in shown.items()}
        errors.append(ErrorModel.model_validate({"name": name, "unit": unit, **shown}))
    differs, left = faults(fit, number), undetermined(fit)
    return RingFitModel(
        ring=number,
        link=fit.nominal.link,
        verdict="differs" if differs else "not determined" if left else "as proposed",
        readings=fit.used,
        scale=round(fit.scale, _DIGITS),
        errors=errors,
        faults=differs,
        open=left,
        misfits={str(wire): text for wire, text in fit.misfits.items()},
        region_holds=None if truth is None else fit.holds(truth),
    )


def faults(fit: RingFit, number: int) -> list[str]:
    """List the differences of ring ``number`` from its proposal."""
    found = wiring_faults(fit.order, fit.mixed)
    found += _mixed_grids(fit)
    if fit.zones is not None:
        found += fit.zones.faults(number, fit.nominal.link)
    if fit.dead:
        found.append(f"has dead sensors, by place in its frames: {', '.join(map(str, fit.dead))}")
    if fit.ring.position < 0 or fit.ring.position > 1:
        found.append(f"sits beyond its link's end, at {fit.ring.position:.3f}")
    limit = LIMITS[[NAMES.index(name) for name in fit.names]]
    beyond = np.flatnonzero(np.abs(fit.values) > limit + fit.margins())
    return found + [f"is off by more than careful mounting allows: {fit.names[k]}" for k in beyond]


def undetermined(fit: RingFit) -> list[str]:
    """List what the readings do not determine about a ring, with the reason."""
    if fit.unfit:
        return [f"not determined, as proposed here: {fit.unfit}"]
    return [f"not determined by these readings: {', '.join(fit.open)}"] * bool(fit.open)


def _mixed_grids(fit: RingFit) -> list[str]:
    """Describe grids of zones that fit no turn and no mirror, one line for each likely order."""
    each: dict[str, list[str]] = {}
    for wire, text in fit.misfits.items():
        each.setdefault(text, []).append(str(wire))
    return [
        f"the grids of sensors {', '.join(wires)} fit no turn and no mirror"
        + f"; they fit if the {text}: mend the order of the zones in the firmware" * bool(text)
        for text, wires in each.items()
    ]


def truth_of(fit: RingFit, errors: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " p"]:
    """Select from errors by ``NAMES`` those that a fit estimated."""
    return np.array([errors[NAMES.index(name)] for name in fit.names])
