"""Stops a search at a deadline or on request."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class StopToken:
    """Tells a search to stop, after a time or on request."""

    limit: float = math.inf
    """Time until the stop, from now, s."""
    clock: Callable[[], float] = time.monotonic
    """Returns the time in seconds."""
    pulled: threading.Event = field(default_factory=threading.Event)
    """Set to stop earlier."""

    def __post_init__(self) -> None:
        self._deadline = self.clock() + self.limit

    def on(self) -> bool:
        """Return whether to stop."""
        return self.pulled.is_set() or self.clock() > self._deadline
