"""What a search works with besides its options."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ...objectives.verify import Verifier
from ..stop_token import StopToken
from .exchange_points import Fields
from .progress import Progress
from .schedule import Schedule


@dataclass(frozen=True)
class SearchContext:
    """What a search works with besides its options: what it maximises, counts with and obeys."""

    verifier: Verifier
    """Counts the answer and keeps the targets' cells for later counts."""
    aim: Criterion = field(default_factory=Criterion)
    """The criterion to maximise."""
    tell: Callable[[Progress], None] = lambda progress: None
    """Receives the progress from time to time, in the calling thread."""
    brake: StopToken = field(default_factory=StopToken)
    """Ends the search."""
    schedule: Schedule | None = None
    """Rounds of the exchange; by default those of ``usual``."""
    points: Fields | None = None
    """Sample points of an earlier search of the same scene, criterion and seed, whose space
    differed only in its number of rings; by default new ones."""

    @property
    def scene(self) -> Scene:
        """Robot, poses, goals, limits."""
        return self.verifier.scene

    def within(self, limit: float, **note: Any) -> "SearchContext":
        """Return the context of a search within ``limit`` s from now, whose progress has a note:
        the values of fields of ``Progress``."""

        def tell(progress: Progress) -> None:
            self.tell(replace(progress, **note))

        return replace(self, brake=StopToken(limit, self.brake.clock), tell=tell)
