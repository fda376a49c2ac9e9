"""Status of a distance, as the frames of a ring state it, and the codes of ST's chips for it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Integer

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


def millimetres(
    distance: Float[np.ndarray, "*n"], status: Integer[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """Return distances (...) m as whole millimetres, 0 where ``status`` says that there is none.

    Raises:
        ValueError: if a number does not fit its field.
    """
    mm: np.ndarray = np.rint(1000 * np.where(np.isin(status, DISTANT), distance, 0.0))
    if not np.all((mm >= 0) & (mm <= MOST_MM)) or not np.isin(status, list(Status)).all():
        raise ValueError(f"distances must be 0 to {MOST_MM} mm, statuses 0 to {max(Status)}")
    return mm


@dataclass(frozen=True)
class StatusCodes:
    """Status codes of a chip, as its driver states them."""

    chip: str
    """The chips that have them."""
    decoder: str
    """Decoder of packed frames with these codes."""
    meaning: Mapping[int, Status]
    """What a code means; all others are failures."""

    def status(self, code: Integer[np.ndarray, "*n"]) -> Integer[np.ndarray, "*n"]:
        """Return the status of each code."""
        table = np.full(256, Status.FAILED, np.uint8)
        table[list(self.meaning)] = list(self.meaning.values())
        found: np.ndarray = table[code]
        return found


_V, _N, _W = Status.VALID, Status.NO_TARGET, Status.WEAK
CHIPS = (
    # ST, UM2884, for the VL53L5CX: confidence of 6, 9 and 10 is 50 %
    StatusCodes(
        "VL53L5CX, VL53L7CX or VL53L8CX", "esp32-l5cx", {5: _V, 6: _W, 9: _W, 10: _W, 255: _N}
    ),
    # ST, VL53L1X ULD driver (also VL53L4CD and VL53L4CX)
    StatusCodes("VL53L1X or VL53L4", "esp32-l1x", {0: _V, 1: _W, 2: _N, 3: _W, 4: _N}),
    # the register of the VL53L1X from which its driver derives these codes
    StatusCodes("VL53L1X (its register)", "esp32-l1x-raw", {9: _V, 6: _W, 8: _W, 4: _N, 5: _N}),
)


def likely_chip(codes: Integer[np.ndarray, " 256"]) -> StatusCodes | None:
    """Return the chip whose codes a ring seems to send, from the number of each code; None if no
    code says so.
    """
    valid = [
        sum(int(codes[code]) for code, status in one.meaning.items() if status == Status.VALID)
        for one in CHIPS
    ]
    if codes[[5, 10, 255]].any():  # the register of a VL53L1X has 9 for a valid distance, too
        valid[0] += int(codes[9])
        valid[2] = 0
    if not any(valid):  # no sensor has a target
        return CHIPS[0] if codes[255] else CHIPS[1] if codes[4] or codes[7] else None
    return CHIPS[int(np.argmax(valid))]
