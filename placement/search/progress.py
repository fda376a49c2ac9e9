"""Progress, outcome and statistics of a search."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal

from ...coverage.definitions.definition import definition
from ...coverage.definitions.units import Covered, Decimals
from ...coverage.rings.ring import Setup
from ..stop_token import StopToken


class Outcome(StrEnum):
    """How a search ended; the value is the text for the user."""

    FINISHED = "the search completed its schedule"
    TIME = "time limit reached; this is the best result so far"
    INTERRUPTED = "interrupted; this is the best result so far"

    @staticmethod
    def of(brake: StopToken, late: bool) -> "Outcome":
        """Return how a search ended that a brake may have interrupted; ``late``: by its limit."""
        if brake.pulled.is_set():
            return Outcome.INTERRUPTED
        return Outcome.TIME if late else Outcome.FINISHED


@definition
class StageResult:
    """What one stage of a search reached."""

    name: Literal["global", "local", "verdict"]
    """The stage."""
    value: Annotated[float, Covered("percent")]
    """Criterion of its best setup: on the sample points, and in the verdict the count."""
    seconds: Annotated[float, Decimals(1)]
    """Wall-clock time, s."""


@dataclass
class Progress:
    """Progress of a running search."""

    stage: int = 0
    """Number of the current stage, from 1."""
    stages: int = 0
    """Number of stages."""
    done: int = 0
    """Finished local searches of the stage, or percent of a round."""
    climbs: int = 0
    """Local searches of the stage; 100 in a round."""
    best: float = 0.0
    """Best share of points so far."""
    setup: Setup | None = None
    """The setup with the best share."""
    counted: int = 0
    """Pairs of target and pose that are counted."""
    to_count: int = 0
    """Pairs of target and pose to count; 0 before the count."""
    sensors: int | None = None
    """Sensors in this search, where several searches with different counts follow each other."""
    rings: int | None = None
    """Rings in this search, where several searches with fewer and fewer rings follow each other."""

    search: int = 1
    """Number of the search, from 1, where several with different random seeds follow each other."""
    searches: int = 1
    """Number of these searches."""

    @property
    def climbed(self) -> float:
        """Number of finished stages, with the finished part of the current one; 0 before
        the first."""
        return max(self.stage - 1, 0) + self.done / max(self.climbs, 1)
