"""Required coverages of a scene, decided by certified bounds."""

import math
from dataclasses import dataclass

from ...coverage.rings.ring import Setup
from ...objectives.scene import CoreScene
from ...objectives.verify import Verifier

_WIDTHS = (0.005, 0.001, 0.0005)  # of the interval, until it decides


@dataclass(frozen=True)
class Requirement:
    """A required coverage of a target, with the proved interval of the coverage, in percent."""

    target: str
    """Label of the target."""
    percent: float
    """Required coverage."""
    low: float
    """Lower bound of the coverage, rounded down to hundredths."""
    high: float
    """Upper bound of the coverage, rounded up to hundredths."""

    @property
    def passes(self) -> bool:
        """Whether the lower bound reaches the required coverage."""
        return self.low >= self.percent

    @property
    def sentence(self) -> str:
        """The requirement and what is proved about it."""
        proved = f"proved: {self.low:.2f} to {self.high:.2f} %"
        doubt = (
            "; the interval contains the required value, so it is not proved"
            if self.low < self.percent <= self.high
            else ""
        )
        return f"{self.target} requires at least {self.percent:g} %; {proved}{doubt}"


def decide(scene: CoreScene, setup: Setup) -> list[Requirement]:
    """Return the requirements of a scene's goals, decided for a setup.

    Each interval is narrowed until it decides its requirement, or down to a twentieth of a point.
    """
    decided = list[Requirement]()
    for goal in scene.targets:
        if goal.at_least <= 0:
            continue
        low, high = 0.0, 1.0
        for width in _WIDTHS:
            verified = Verifier(scene, None, "certified", width).verify(setup, goal.target)
            low, high = verified.low, verified.high
            if low >= goal.at_least or high < goal.at_least:
                break
        decided.append(
            Requirement(
                str(goal.target),
                round(100 * goal.at_least, 9),
                math.floor(1e4 * low) / 100,
                math.ceil(1e4 * high) / 100,
            )
        )
    return decided
