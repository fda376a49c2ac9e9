"""Tests of the paper's statements on coverage against the counts here, in one reading each.

A test returns the measurement as text, and whether the statement agrees with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from ...coverage.targets.target import Target
from .coverage_cells import FAR, NEAR, TARGETS, THETAS, CoverageRow
from .figures import value
from .statements import Measurement, Reading, Test

OVER_ALL = 65.0  # percent, n3_16_55 for every target
NEAR_SAME = 5.0  # points: "similar", "equivalent"
_TOGETHER = 0.7  # rank correlation of at least this counts as growth


@dataclass(frozen=True)
class CoverageTests:
    """The counts against which statements are tested."""

    configurations: Sequence[CoverageRow]
    """ζ of the setups of the bar chart."""
    tilts: Sequence[CoverageRow]
    """ζ of n2_16_theta for all tilts."""

    def zeta(self, setup: str, target: Target, reading: Reading) -> float:
        """Return ζ of a setup, percent."""
        return value(
            self.configurations, chain=reading[0], rule=reading[1], setup=setup, target=str(target)
        )

    def line(self, reading: Reading, target: Target) -> np.ndarray:
        """Return ζ of n2_16_theta for each theta, percent."""
        where = {"chain": reading[0], "rule": reading[1], "target": str(target)}
        return np.array([value(self.tilts, **where, at=theta) for theta in THETAS])

    def number(self, setup: str, target: Target, published: float, within: float) -> Test:
        """Return the test that ζ of a setup is the published one up to ``within`` points."""

        def test(reading: Reading) -> Measurement:
            found = self.zeta(setup, target, reading)
            return f"{found:.2f}", abs(found - published) <= within

        return test

    def over(self, setup: str, target: Target, least: float) -> Test:
        """Return the test that ζ of a setup is more than ``least`` percent."""
        return lambda reading: (
            f"{self.zeta(setup, target, reading):.1f}",
            self.zeta(setup, target, reading) > least,
        )

    def over_all(self, reading: Reading) -> Measurement:
        """Test that n3_16_55 covers over 65 % of every target."""
        least = min(TARGETS, key=lambda t: self.zeta("n3_16_55", t, reading))
        found = self.zeta("n3_16_55", least, reading)
        return f"minimum {found:.1f} ({least})", found > OVER_ALL

    def grows(self, reading: Reading) -> Measurement:
        """Test that ζ grows with sensors per ring and rings per link."""
        chain = ["n1_8_0", "n1_16_0", "n2_16_25", "n3_16_55"]
        steps = [np.diff([self.zeta(s, t, reading) for s in chain]).min() for t in TARGETS]
        return f"smallest step {min(steps):+.1f}", min(steps) > 0

    def every_two(self, reading: Reading) -> Measurement:
        """Test that two rings of the bar chart cover more than one."""
        names = ("n2_16_10", "n2_16_25", "n2_16_55")
        gain = min(
            self.zeta(s, t, reading) - self.zeta("n1_16_0", t, reading)
            for s in names
            for t in TARGETS
        )
        return f"smallest gain over n1_16_0 {gain:+.1f}", gain > 0

    def alike(self, reading: Reading) -> Measurement:
        """Test that n2_16_10 covers about what n1_16_0 does."""
        off = [
            self.zeta("n2_16_10", t, reading) - self.zeta("n1_16_0", t, reading) for t in TARGETS
        ]
        return f"{min(off):+.1f} to {max(off):+.1f}", max(map(abs, off)) <= NEAR_SAME

    def lowest(self, reading: Reading) -> Measurement:
        """Test that n2_16_10 is near the lowest of the sweep for each target."""
        at = {str(t): THETAS[int(np.argmin(self.line(reading, t)))] for t in TARGETS}
        below = sum(theta in (5, 10, 15) for theta in at.values())
        return "lowest at " + ", ".join(f"{theta}° ({t})" for t, theta in at.items()), below == len(
            TARGETS
        )

    def dip(self, reading: Reading) -> Measurement:
        """Test that n2_16_10 lies below n2_16_0 and n2_16_25."""
        lines = [self.line(reading, t) for t in TARGETS]
        deep = [
            float(line[THETAS.index(10)] - max(line[0], line[THETAS.index(25)])) for line in lines
        ]
        return (
            f"10° minus the better of 0° and 25°: {min(deep):+.1f} to {max(deep):+.1f}",
            max(deep) < 0,
        )

    def far_best(self, reading: Reading) -> Measurement:
        """Test that V_S(1.5) is covered best at 0°, and has a second peak at 25°."""
        line = self.line(reading, FAR)
        second = int(np.argmax(line[2:])) + 2
        text = (
            f"{line[0]:.1f} at 0°, {line[THETAS.index(25)]:.1f} at 25°, second peak"
            f" {line[second]:.1f} at {THETAS[second]}°"
        )
        return text, line[0] >= line[:2].max() and abs(THETAS[second] - 25) <= 5

    def near_grows(self, reading: Reading) -> Measurement:
        """Test that ζ of V_S(0.5) grows with theta."""
        line = self.line(reading, NEAR)
        together = float(spearmanr(THETAS, line).statistic)
        text = (
            f"{line[0]:.1f} at 0°, {line.min():.1f} at {THETAS[int(line.argmin())]}°,"
            f" {line[-1]:.1f} at 60°"
        )
        return (
            f"{text}, rank correlation {together:.2f}",
            together >= _TOGETHER and line[-1] > line[0],
        )

    def near_best(self, reading: Reading) -> Measurement:
        """Test that ζ of V_S(0.5) is best at 25°."""
        line = self.line(reading, NEAR)
        best = THETAS[int(line.argmax())]
        at = line[THETAS.index(25)]
        return f"near best at {best}° ({line.max():.1f}; 25° gives {at:.1f})", abs(best - 25) <= 5
