"""Effective range of a sensor for a target: the rules that limit it, applied one after
the other.

No rule extrapolates silently.

- Light: use the figure for the next stronger light that a source states. Light beyond all stated
  levels is rejected.
- Reflectance: the signal that returns from a target that fills the beam falls with rho / d^2, so
  the range grows with the root of rho. The law starts from the next brighter measured target. It is
  checked against measurements with darker targets (it gives 1.58 m where 1.70 m were measured, and
  4.0 where 5.0 were), and the result is never below these.
- Size: from a target that does not fill the beam, the share fill(d) of the light returns, so that
  fill(d) (d_max / d)^2 = 1 (a rule quoted beside the manufacturers' datasheets).
- Base: the beam ends in a plane, and the plane's corners or edge must lie within the range.

The minimum range does not shorten the beam: no source states that a nearer target is not reported.
"""

import math
import re
from dataclasses import dataclass

from .catalogue import model_of
from .sensor import Sensor, Use
from .sensor_model import DARK, Figure, Light, Model


@dataclass(frozen=True)
class Step:
    """One rule of the derivation."""

    rule: str
    """Name of the rule."""
    found: str
    """The values to which it was applied, as text."""
    range_m: float
    """Range after the rule, m."""
    measured: bool
    """Whether the range is a measured figure, as the manufacturer states it, or follows from a
    law."""


@dataclass(frozen=True)
class Effective:
    """A sensor for a use, and the derivation of its range."""

    model: Model
    """The model, of the catalogue or the user's own."""
    use: Use
    """The use."""
    steps: tuple[Step, ...]
    """The applied rules; the range of the last one is used."""

    @property
    def range_m(self) -> float:
        return self.steps[-1].range_m

    @property
    def sensor(self) -> Sensor:
        """The resulting sensor."""
        m = self.model
        along, up = (math.radians(side) for side in m.sides_deg)
        return Sensor(along, self.range_m, self.use, up if m.square else None, m.zones, m.board)


def effective(use: Use) -> Effective:
    """Return the effective range of a sensor for ``use``.

    Raises:
        ValueError: if the model is unknown, the light has no figure, the reflectance is outside
            (0, 1], or a size is not positive.
    """
    m = model_of(use)
    best = max((f for f in m.figures if f.light == m.lights[0]), key=lambda f: f.reflectance)
    steps = [
        Step(
            "as stated",
            f"{_percent(best.reflectance)} target that fills the beam, {best.light.label}",
            best.range_m,
            True,
        )
    ]
    light = m.lights[0] if use.ambient is None else _light(m, use.ambient)
    figure = max((f for f in m.figures if f.light == light), key=lambda f: f.reflectance)
    if use.ambient is not None:
        same = light.label == use.ambient
        steps.append(
            Step(
                "light",
                use.ambient + ("" if same else f", by the figure for {light.label}"),
                figure.range_m,
                same,
            )
        )
    if use.reflectance is not None:
        steps.append(_by_reflectance(m, light, use.reflectance))
    if use.size is not None:
        steps.append(_by_size(m, use.size, steps[-1]))
    steps.append(_by_base(m, steps[-1].range_m))
    return Effective(m, use, tuple(steps))


def _light(m: Model, ambient: str) -> Light:
    """Return the weakest light with a figure that is at least as strong as ``ambient``."""
    if ambient == DARK.label:
        return m.lights[0]
    named = [light for light in m.lights if light.label == ambient]
    if named:
        return named[0]
    most = m.lights[-1]
    known = (
        f"dark, or a number of {m.unit} up to {most.label}"
        if m.unit and most.value
        else ", ".join(x.label for x in m.lights)
    )
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([a-z]+)", ambient) if m.unit else None
    if match is None or match[2] != m.unit or float(match[1]) > most.value:
        raise ValueError(
            f"found ambient light {ambient!r}, allowed for {m.name}: {known}; no source states a"
            " range in stronger light"
        )
    return next(light for light in m.lights if light.value >= float(match[1]))


def _by_reflectance(m: Model, light: Light, rho: float) -> Step:
    if not 0 < rho <= 1:
        raise ValueError(f"reflectance must be above 0 and at most 1, got {rho:g}")

    def known(figures: list[Figure]) -> Figure | None:
        return max(figures, key=lambda f: f.range_m) if figures else None

    here = [f for f in m.figures if f.light == light]
    brighter = [f for f in here if f.reflectance >= rho] or [max(here, key=lambda f: f.reflectance)]
    above = min(brighter, key=lambda f: f.reflectance)
    by_law = above.range_m * math.sqrt(min(rho / above.reflectance, 1.0))
    darker = known([f for f in m.figures if f.light.value >= light.value and f.reflectance <= rho])
    text = _percent(rho)
    if darker is not None and darker.range_m >= by_law:
        return Step(
            "reflectance",
            f"{text}, by the figure for {_percent(darker.reflectance)}, {darker.light.label}",
            darker.range_m,
            True,
        )
    least = min(f.reflectance for f in m.figures)
    beyond = f", darker than any measured ({_percent(least)})" if rho < least else ""
    return Step(
        "reflectance",
        f"{text}{beyond}, by the inverse square from {_percent(above.reflectance)}",
        by_law,
        False,
    )


def _by_size(m: Model, size: tuple[float, float], before: Step) -> Step:
    """Apply the rule for the target's size.

    With A = w / (2 tan(a / 2)), fill(d) = min(1, A / d) min(1, B / d) is the least of four
    products, each falling with d. The solution of fill(d) (range / d)^2 = 1 is therefore the least
    of the four solutions for the single products.
    """
    if not all(math.isfinite(s) and s > 0 for s in size):
        raise ValueError(
            f"the target's width and height must be positive, got {size[0]:g} x {size[1]:g} m"
        )
    a, b = (
        s / (2 * math.tan(math.radians(deg) / 2)) for s, deg in zip(size, m.zone_deg, strict=True)
    )
    d2 = before.range_m**2
    left = min(before.range_m, (a * d2) ** (1 / 3), (b * d2) ** (1 / 3), (a * b * d2) ** (1 / 4))
    what = "zone" if m.zones > 1 else "beam"
    text = f"{size[0]:g} × {size[1]:g} m against a {what} of {m.zone_deg[0]:.3g}°"
    fills = left == before.range_m
    return Step("size", text + ", which it fills" * fills, left, before.measured and fills)


def _by_base(m: Model, range_m: float) -> Step:
    along, up = (math.tan(math.radians(side) / 2) for side in m.sides_deg)
    shape = "square" if m.square else "round"
    sides = " by ".join(f"{side:.3g}°" for side in dict.fromkeys(m.sides_deg))
    return Step(
        "base",
        f"{shape} beam of {sides} ends in a plane",
        range_m / math.hypot(1.0, along, up if m.square else 0.0),
        False,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def size_of(text: str) -> tuple[float, float]:
    """Return width and height, m, of a text such as ``0.1x0.4``; raise ``ValueError`` otherwise."""
    match = re.fullmatch(r"(\d*\.?\d+)[x×](\d*\.?\d+)", text.strip())
    if match is None or not (float(match[1]) > 0 and float(match[2]) > 0):
        raise ValueError(f"target size must be WIDTHxHEIGHT in metres, like 0.1x0.4, got {text!r}")
    return float(match[1]), float(match[2])
