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
from typing import Annotated

from pydantic import AfterValidator, Discriminator, Field, Tag

from ..definitions.definition import definition, refuse
from ..definitions.errors import IN_LINE, NAMED
from ..definitions.field_types import Metres, Pair, Text
from .catalogue import MODELS
from .sensor_model import DARK, Model


def _not_of_the_catalogue(model: Model) -> Model:
    if model.name in MODELS:
        refuse([(("name",), model.name, "a name that the catalogue lacks")])
    return model


OwnModel = Annotated[Model, AfterValidator(_not_of_the_catalogue)]
"""A user's own sensor."""


@definition
class Use:
    """A sensor model under its operating conditions; None: as the manufacturer measured."""

    model: Annotated[
        Annotated[Text, Tag(NAMED)] | Annotated[OwnModel, Tag(IN_LINE)],
        Discriminator(lambda value: IN_LINE if isinstance(value, dict | Model) else NAMED),
    ]
    """Model in the catalogue, a sensor file (.toml), or a sensor's table in-line."""
    ambient: Text | None = None
    """Ambient light, for example 50kcps or 5klx."""
    reflectance: Annotated[float, Field(gt=0, le=1)] | None = None
    """Reflectance of the target, as a share."""
    target_size: Pair[Metres] | None = None
    """Width and height of the target, m."""

    def __post_init__(self) -> None:
        if isinstance(self.model, str) and self.model not in MODELS:
            refuse([(("model",), self.model, f"{', '.join(MODELS)}, or a sensor file (.toml)")])

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.model if isinstance(self.model, str) else self.model.name


def model_of(use: Use) -> Model:
    """Return the model of a use: the user's own, or that of the catalogue."""
    return MODELS[use.model] if isinstance(use.model, str) else use.model


@definition
class Step:
    """A rule that limits a range."""

    rule: str
    """Name of the rule."""
    found: str
    """Data behind the rule."""
    range_m: Metres
    """Range after the rule, m."""
    measured: bool
    """Whether the rule is a measurement; otherwise it is a law."""


def steps(use: Use) -> tuple[Step, ...]:
    """Return the rules that limit the range of a sensor for ``use``, each with the range after it.

    Raises:
        ValueError: if the light has no figure.
    """
    m = model_of(use)
    dark, *_ = m.levels
    best = m.brightest(m.levels[dark])
    target = f"{_percent(best.reflectance)} target that fills the beam, {best.ambient}"
    rules = [Step("as stated", target, best.range_m, True)]
    light = dark if use.ambient is None else _light(m, use.ambient)
    if use.ambient is not None:
        same = light == use.ambient
        text = use.ambient + ("" if same else f", by the figure for {light}")
        rules.append(Step("light", text, m.brightest(m.levels[light]).range_m, same))
    if use.reflectance is not None:
        rules.append(_by_reflectance(m, m.levels[light], use.reflectance))
    if use.target_size is not None:
        rules.append(_by_size(m, use.target_size, rules[-1]))
    rules.append(_by_base(m, rules[-1].range_m))
    return tuple(rules)


def _light(m: Model, ambient: str) -> str:
    """Return the weakest level of light with a figure that is at least as strong as ``ambient``."""
    if ambient in m.levels:
        return ambient
    (weakest, *_), most = m.levels, [*m.levels][-1]
    if ambient == DARK:
        return weakest
    known = f"dark, or a number of {m.unit} up to {most}" if m.unit else ", ".join(m.levels)
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([a-z]+)", ambient) if m.unit else None
    if match is None or match[2] != m.unit or float(match[1]) > m.levels[most]:
        raise ValueError(
            f"found ambient light {ambient!r}, allowed for {m.name}: {known}; no source states a"
            " range in stronger light"
        )
    return next(light for light, level in m.levels.items() if level >= float(match[1]))


def _by_reflectance(m: Model, level: float, rho: float) -> Step:
    here = [r for r in m.ranges if m.levels[r.ambient] == level]
    brighter = [r for r in here if r.reflectance >= rho] or [m.brightest(level)]
    above = min(brighter, key=lambda r: r.reflectance)
    by_law = above.range_m * math.sqrt(min(rho / above.reflectance, 1.0))
    text = _percent(rho)
    darker = [r for r in m.ranges if m.levels[r.ambient] >= level and r.reflectance <= rho]
    measured = max(darker, key=lambda r: r.range_m, default=None)
    if measured is not None and measured.range_m >= by_law:
        return Step(
            "reflectance",
            f"{text}, by the figure for {_percent(measured.reflectance)}, {measured.ambient}",
            measured.range_m,
            True,
        )
    least = min(r.reflectance for r in m.ranges)
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
