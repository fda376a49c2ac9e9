"""How far a sensor of the catalogue sees a target: the rules that limit it, one after the other,
and the least of them.

Nothing is extrapolated in silence. Light: the figure for the next stronger light that a source has;
a light beyond all of them is refused. Reflectance: the returned signal of a target that fills the
beam falls with rho / d^2, so that the range goes with the root of rho; this law, from the next
brighter target measured, is held against what was measured with darker ones (it gives 1.58 m where
1.70 m were measured, and 4.0 where 5.0 were), and never gives less than these. Size: of a target
that does not fill the beam the share fill(d) of the light returns, so that fill(d) (d_max / d)^2 =
1 (a rule quoted beside the makers' datasheets). Base: the beam ends in a plane, whose corners or
edge shall not be further than the range.

The least range takes nothing from the beam: no source says that a nearer target goes unreported.
"""

import math
import re
from dataclasses import dataclass

from .catalogue import DARK, Figure, Light, Model, model
from .sensor import Sensor, Use


@dataclass(frozen=True)
class Step:
    """One rule: what it is about, what was found for it, the range m that is left after it, and
    whether that rests on a figure that was measured (as the maker states it) or on a law."""

    rule: str
    found: str
    range_m: float
    measured: bool


@dataclass(frozen=True)
class Effective:
    """A sensor for a use, and how its range came about; the last step's range is the one used."""

    model: Model
    use: Use
    steps: tuple[Step, ...]

    @property
    def range_m(self) -> float:
        return self.steps[-1].range_m

    @property
    def sensor(self) -> Sensor:
        """The sensor as the rest of the toolkit sees it."""
        side = math.radians(self.model.side_deg)
        m = self.model
        return Sensor(side, self.range_m, self.use, side if m.square else None, m.zones, m.board)


def effective(use: Use) -> Effective:
    """How far a sensor of the catalogue sees the target of ``use``.

    Raises:
        ValueError: for a model that is not in the catalogue, a light for which there is no figure,
            a reflectance outside
            (0, 1] or a size that is not positive; it says what is allowed.
    """
    m = model(use.model)
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
    """The weakest light with a figure that is at least as strong as asked."""
    if ambient == DARK.label:
        return m.lights[0]
    named = [light for light in m.lights if light.label == ambient]
    if named:
        return named[0]
    most = m.lights[-1]
    known = (
        f"dark, or {m.unit} up to {most.label}"
        if m.unit and most.value
        else ", ".join(x.label for x in m.lights)
    )
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([a-z]+)", ambient) if m.unit else None
    if match is None or match[2] != m.unit or float(match[1]) > most.value:
        raise ValueError(
            f"found light {ambient!r}, allowed for {m.name}: {known}; nothing beyond is sourced"
        )
    return next(light for light in m.lights if light.value >= float(match[1]))


def _by_reflectance(m: Model, light: Light, rho: float) -> Step:
    if not 0 < rho <= 1:
        raise ValueError(f"found reflectance {rho:g}, allowed: above 0 and at most 1")

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
    """fill(d) = min(1, A / d) min(1, B / d) with A = w / (2 tan(a / 2)) is the least of four
    products, each falling with d: the d at which fill(d) (range / d)^2 = 1 is the least of the four
    at which each is 1."""
    if not all(math.isfinite(s) and s > 0 for s in size):
        raise ValueError(
            f"found a target of {size[0]:g} x {size[1]:g} m, allowed: positive lengths"
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
    tangent = math.tan(math.radians(m.side_deg) / 2) * (math.sqrt(2) if m.square else 1.0)
    shape = "square" if m.square else "round"
    return Step(
        "base",
        f"{shape} beam of {m.side_deg:.3g}° ends in a plane",
        range_m / math.hypot(1.0, tangent),
        False,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def size_of(text: str) -> tuple[float, float]:
    """``0.1x0.4`` as width and height, m; ValueError says what is allowed."""
    match = re.fullmatch(r"(\d*\.?\d+)[x×](\d*\.?\d+)", text.strip())
    if match is None or not (float(match[1]) > 0 and float(match[2]) > 0):
        raise ValueError(f"found size {text!r}, allowed: WIDTHxHEIGHT in metres, like 0.1x0.4")
    return float(match[1]), float(match[2])
