"""Stops a search at a deadline or on request."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class StopToken:
    """Tells a search to stop, after a deadline or on request."""

    deadline: float
    """Time of the ``clock`` after which to stop, s."""
    pulled: threading.Event = field(default_factory=threading.Event)
    """Set to stop before the deadline."""
    clock: Callable[[], float] = time.monotonic
    """Returns the time in seconds."""

    def on(self) -> bool:
        """Return whether to stop."""
        return self.pulled.is_set() or self.clock() > self.deadline
