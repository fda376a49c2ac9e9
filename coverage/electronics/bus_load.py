"""Load, pull-ups and rise times of I2C lines, by NXP's UM10204 (I2C-bus specification), at 3.3 V.

A line rises through its pull-ups R against its load C: from 0.3 to 0.7 of the supply in
ln(7/3) R C = 0.8473 R C (UM10204, 7.1). A device that pulls the line low must sink the current of
all pull-ups.
"""

import math
from dataclasses import dataclass

SUPPLY = 3.3  # V
LOW = 0.4  # V, highest low level
MOST_PF = 400.0
MOST_MA = 3.0  # that every device can sink at LOW
RISE_NS = {400_000: 300.0, 100_000: 1000.0}  # longest rise by clock, Hz
PIN_PF = 10.0  # largest load of a device's pin
CABLE_PF_M = 100.0  # of a thin four-wire cable: typically 50 to 100
RESISTORS = tuple(  # Ω, to add to a line: the series E12, weakest first
    100.0 * ohm for ohm in (100, 82, 68, 56, 47, 39, 33, 27, 22, 18, 15, 12, 10)
)
_RISE = math.log(7 / 3)


@dataclass(frozen=True)
class BusLine:
    """One line, SDA or SCL, of a bus or of a part that a switch connects to it."""

    load_pf: float
    """Load, pF."""
    conductance: float
    """Sum of 1/R of its pull-ups to the supply, 1/Ω."""
    sink_ma: float
    """Current that a low level draws, mA."""

    @property
    def rise_ns(self) -> float:
        """Rise time, ns; infinite without a pull-up."""
        if not self.conductance:
            return math.inf
        return 1e-3 * _RISE * self.load_pf / self.conductance

    def joined(self, other: "BusLine") -> "BusLine":
        """Return both lines, connected."""
        return BusLine(
            self.load_pf + other.load_pf,
            self.conductance + other.conductance,
            self.sink_ma + other.sink_ma,
        )

    def pulled_up(self, ohm: float | None) -> "BusLine":
        """Return the line with one more pull-up, or with none for None."""
        return self if ohm is None else self.joined(pull_up(ohm))


def load(picofarad: float) -> BusLine:
    """Return a line with a load and no pull-up."""
    return BusLine(picofarad, 0.0, 0.0)


def pull_up(ohm: float, supply: float = SUPPLY, *, shifted: bool = False) -> BusLine:
    """Return a pull-up.

    Args:
        ohm: resistance, Ω.
        supply: supply that it leads to, V.
        shifted: whether it is behind a level shifter: a low level draws its current, but it does
            not lift the line.
    """
    return BusLine(0.0, 0.0 if shifted else 1 / ohm, 1e3 * (supply - LOW) / ohm)


def fault(line: BusLine, hertz: int) -> str:
    """Return what a line exceeds, or nothing if it keeps to the limits at a clock of ``hertz``."""
    if line.load_pf > MOST_PF:
        return f"{line.load_pf:.0f} pF on a line, allowed: {MOST_PF:.0f}"
    if line.sink_ma > MOST_MA:
        return f"{line.sink_ma:.1f} mA through the pull-ups of a line, allowed: {MOST_MA:g}"
    if line.rise_ns > RISE_NS[hertz]:
        return f"a line rises in {line.rise_ns:.0f} ns, allowed: {RISE_NS[hertz]:.0f}"
    return ""


def weakest_pull_up(line: BusLine, hertz: int) -> float | None:
    """Return the weakest resistor, Ω, with which the line rises in time; None if it needs none, and
    the strongest if none is enough."""
    if line.rise_ns <= RISE_NS[hertz]:
        return None
    return next(
        (ohm for ohm in RESISTORS if line.pulled_up(ohm).rise_ns <= RISE_NS[hertz]),
        RESISTORS[-1],
    )
