"""Required coverages of a scene, decided by certified bounds."""

import math

from ...coverage.rings.ring import Setup
from ...formats.schema.written_models import RequirementModel
from ...objectives.scene import Scene
from ...objectives.verify import Verifier

_WIDTHS = (0.005, 0.001, 0.0005)  # of the interval, until it decides


def requirement_sentence(r: RequirementModel) -> str:
    """Return a requirement and what is proved about it."""
    proved = f"proved: {r.low_percent:.2f} to {r.high_percent:.2f} %"
    doubt = (
        "; the interval contains the required value, so it is not proved"
        if r.low_percent < r.required_percent <= r.high_percent
        else ""
    )
    return f"{r.target} requires at least {r.required_percent:g} %; {proved}{doubt}"


def decide(scene: Scene, setup: Setup) -> list[RequirementModel]:
    """Return the requirements of a scene's goals, decided for a setup.

    Each interval is narrowed until it decides its requirement, or down to a twentieth of a point.
    Its ends are rounded outward to hundredths.
    """
    decided = list[RequirementModel]()
    for goal in scene.targets:
        if goal.at_least <= 0:
            continue
        low, high = 0.0, 1.0
        for width in _WIDTHS:
            verified = Verifier(scene, None, "certified", width).verify(setup, goal.target)
            low, high = verified.low, verified.high
            if low >= goal.at_least or high < goal.at_least:
                break
        required, low_percent = round(100 * goal.at_least, 9), math.floor(1e4 * low) / 100
        decided.append(
            RequirementModel(
                target=str(goal.target),
                required_percent=required,
                low_percent=low_percent,
                high_percent=math.ceil(1e4 * high) / 100,
                passes=low_percent >= required,
            )
        )
    return decided
