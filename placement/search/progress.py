"""What a search tells: while it runs how far it is, and at its end how that came."""

from dataclasses import dataclass
from enum import Enum

from ...coverage.rings.ring import Setup


class Outcome(Enum):
    """How a search ended; the text is for its user."""

    FINISHED = "the schedule of starts and steps ran to its end"
    TIME = "the time cap bit: this is the best until then"
    INTERRUPTED = "interrupted: this is the best until then"


@dataclass(frozen=True)
class Statistics:
    """What a search spent: starts, evaluations of value and gradient, seconds; and the width of its
    last stage, m
    (0: nothing climbed, and the soft value is a share of points)."""

    starts: int
    evaluations: int
    seconds: float
    width: float


@dataclass
class Progress:
    """What a search tells while it runs: stage, of how many, climbs done, of how many, best share
    of points so far and the setup that has it; then targets at poses counted, of how many (0: not
    yet counting)."""

    stage: int = 0
    stages: int = 0
    done: int = 0
    climbs: int = 0
    best: float = 0.0
    setup: Setup | None = None
    counted: int = 0
    to_count: int = 0
    sensors: int | None = None
    """Of this search, where several with other numbers of sensors go after each other."""

    @property
    def climbed(self) -> float:
        """Stages that are over, a part of one by its climbs; 0 before the first."""
        return max(self.stage - 1, 0) + self.done / max(self.climbs, 1)
