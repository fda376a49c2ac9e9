"""Counts of a ring's line."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Integer


@dataclass
class Counts:
    """Counts of a line."""

    frames: int = 0
    """Frames passed on."""
    lost: int = 0
    """Gaps in the sequence."""
    late: int = 0
    """Frames that arrived after a newer one, or twice; not passed on."""
    corrupt: int = 0
    """Byte sequences that began like a frame and were not one."""
    skipped: int = 0
    """Bytes that belong to no frame."""
    restarts: int = 0
    """Restarts of the ring."""
    doubled: int = 0
    """Frames with the number of the frame before and another time: from another ring."""
    serials: Counter[str] = field(default_factory=Counter)
    """Number of hellos of each board, by its serial number; empty if none says hello."""
    sizes: Counter[int] = field(default_factory=Counter)
    """Number of intact frames with another number of sensors, by that number."""
    foreign: str = ""
    """The first line of text outside the decoder's grammar, shortened and quoted; empty if none."""
    codes: Integer[np.ndarray, "n 256"] | None = field(default=None, compare=False)
    """Number of each status code of each sensor, with those of its zones; None before a frame."""
    waiting: int = 0
    """Lines of text that wait until their grammar is recognised."""

    def take_codes(self, status: Integer[np.ndarray, "*each"]) -> None:
        """Count the status codes of a frame, (n,) or (n, z)."""
        count = len(status)
        if self.codes is None:
            self.codes = np.zeros((count, 256), int)
        np.add.at(self.codes, (np.arange(count)[:, None], status.reshape(count, -1)), 1)
