"""Status of a distance, as the frames of a ring state it."""

from enum import IntEnum

import numpy as np
from jaxtyping import Integer

MOST_MM = 0xFFFF


class Status(IntEnum):
    """Status of a sensor's distance."""

    VALID = 0
    NO_TARGET = 1
    WEAK = 2
    FAILED = 3


# status of a sensor or zone without a reading in a frame; no byte decodes to it
ABSENT = 255
DISTANT = (Status.VALID, Status.WEAK)  # with a distance
_KNOWN = np.array(
    [byte if byte in list(Status) else Status.FAILED for byte in range(256)], np.uint8
)


def known_status(status: Integer[np.ndarray, "*n"]) -> Integer[np.ndarray, "*n"]:
    """Return status bytes, where an unknown one counts as a failure."""
    known: np.ndarray = _KNOWN[status]
    return known
