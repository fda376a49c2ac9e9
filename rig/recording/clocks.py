"""Clocks: how late something came by its sender's clock, and how a sender's clock and the host's go
together.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import theilslopes

_DRIFT = 2e-4  # the most that two clocks of quartz drift apart
_BLOCKS = 300  # whose quickest arrivals a line goes through
_FEWEST = 10


class Lag:
    """How much later than the quickest something came. The sender's clock starts anywhere and
    drifts.
    """

    def __init__(self) -> None:
        self._least, self._time = np.inf, 0.0

    def delay(self, time: float, clock: float) -> float:
        """Seconds by which what was sent at ``clock`` s and came at ``time`` s is later than the
        quickest before it.

        Negative if it was quicker, 0 for the first.
        """
        lag, least = time - clock, self._least + _DRIFT * (time - self._time)
        self._least, self._time = min(lag, least), time
        return lag - least if np.isfinite(least) else 0.0


@dataclass(frozen=True)
class Alignment:
    """A sender's clock against the host's: host time = offset + (1 + drift) · (clock - origin), s.

    low, high: 95 % interval of the drift. jitter: s, 95 % of arrivals come no later than so long
    after the line. The line goes through the quickest arrivals: what even these take is part of the
    offset, and cannot be told from it.
    """

    origin: float
    offset: float
    drift: float
    low: float
    high: float
    jitter: float

    def host(self, clock: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The host's times of a sender's."""
        return self.offset + (1 + self.drift) * (np.asarray(clock) - self.origin)


def align(time: Float[np.ndarray, " n"], clock: Float[np.ndarray, " n"]) -> Alignment | None:
    """The alignment of arrivals at ``time`` (n,) s on the host of what was sent at ``clock`` (n,)
    s; None of fewer than ten.

    Theil and Sen's line (the median of the slopes of all pairs; 29 % of the points may be anywhere)
    through the quickest arrival of each of up to 300 blocks, as delays only ever add.
    """
    if len(time) < _FEWEST:
        return None
    origin = float(clock[0])
    lag, since = np.asarray(time) - clock, np.asarray(clock) - origin
    blocks = np.array_split(np.arange(len(time)), min(_BLOCKS, max(len(time) // 4, _FEWEST)))
    quickest = np.array([block[lag[block].argmin()] for block in blocks])
    slope, _, low, high = theilslopes(lag[quickest], since[quickest])
    above = lag - slope * since
    offset = float(np.median(above[quickest]))
    return Alignment(
        origin, origin + offset, slope, low, high, float(np.quantile(above - offset, 0.95))
    )
