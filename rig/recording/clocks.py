"""Clocks: delays by the sender's clock, and the alignment of a sender's clock with the host's."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import theilslopes

_DRIFT = 2e-4  # maximum relative drift of two quartz clocks
_WRONG = 1e-2  # relative drift that no quartz clock has
_BLOCKS = 300  # the line passes through the quickest arrival of each
_FEWEST = 10


class Lag:
    """Measures how much later than the quickest arrival something arrived. The sender's clock
    starts at any value and drifts.
    """

    def __init__(self) -> None:
        self._least, self._time = np.inf, 0.0

    def delay(self, time: float, clock: float) -> float:
        """Return the delay in s of data sent at ``clock`` s that arrived at ``time`` s, relative to
        the quickest arrival before it.

        Negative if it was quicker, 0 for the first.
        """
        lag, least = time - clock, self._least + _DRIFT * (time - self._time)
        self._least, self._time = min(lag, least), time
        return lag - least if np.isfinite(least) else 0.0


class RateCheck:
    """Checks that a sender's clock does not run faster than the host's.

    A clock that runs slower needs no check of its own: its data seem to arrive later and later.
    """

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None

    def fault(self, time: float, clock: float, slack: float) -> str | None:
        """Return what is wrong with the clock of data sent at ``clock`` s that arrived at ``time``
        s, or None. The first data may have been up to ``slack`` s late.
        """
        if self._first is None:
            self._first = time, clock
        elapsed, gone = time - self._first[0], clock - self._first[1]
        if gone - elapsed <= slack + _WRONG * elapsed:
            return None
        by = f", {gone:.3g} s in {elapsed:.3g} s" if elapsed > 0 else ""
        return f"runs faster than this computer's{by}"


@dataclass(frozen=True)
class Alignment:
    """A sender's clock relative to the host's: host time = offset + (1 + drift) · (clock - origin),
    s.

    The line passes through the quickest arrivals. The delay that even these have is part of the
    offset and cannot be separated from it.
    """

    origin: float
    """Sender's clock at the origin, s."""
    offset: float
    """Host's clock at the origin, s."""
    drift: float
    """Relative drift of the clocks."""
    low: float
    """Lower end of the 95 % interval of the drift."""
    high: float
    """Upper end of the 95 % interval of the drift."""
    jitter: float
    """95 % of arrivals are at most this late relative to the line, s."""
    spread: float
    """90 % of the quickest arrivals are this close to the line, s."""

    def host(self, clock: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Convert the sender's times to the host's."""
        return self.offset + (1 + self.drift) * (np.asarray(clock) - self.origin)


def align(time: Float[np.ndarray, " n"], clock: Float[np.ndarray, " n"]) -> Alignment | None:
    """Align arrivals at ``time`` (n,) s on the host with data sent at ``clock`` (n,) s; None for
    fewer than ten.

    The line is the Theil–Sen estimate (the median of the slopes of all pairs; up to 29 % of the
    points may be arbitrary) through the quickest arrival of each of up to 300 blocks, because
    delays are never negative.
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
    jitter = float(np.quantile(above - offset, 0.95))
    spread = float(np.quantile(np.abs(above[quickest] - offset), 0.9))
    return Alignment(origin, origin + offset, slope, low, high, jitter, spread)
