"""The paper's statements on coverage, each with the reason of its verdict."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.targets.target import Target
from .coverage_cells import FAR, NEAR, PUBLISHED, TARGETS, THETAS, CoverageRow
from .figures import value
from .statements import Measurement, Reading, Statement, Test, Verdict, judged

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


_INFLATED = (
    "Only rule `touch` with voxels of about 10 cm gives such a number. It counts a voxel as"
    " covered as soon as a beam touches it, which inflates ζ by about ten points. The unbiased"
    " coverage is lower."
)


def coverage(
    configurations: Sequence[CoverageRow], tilts: Sequence[CoverageRow]
) -> Iterator[Statement]:
    """Yield the statements on coverage."""
    tests = CoverageTests(configurations, tilts)
    yield _cone_volume()
    yield from _published_shares(tests)
    yield from _growth(tests)
    yield from _dip(tests)
    yield from _best_tilts(tests)
    yield Statement(
        "A beam projected on a white board is round, so a cone models it.",
        "not measured",
        Verdict.UNDECIDED,
        "This is a physical test of one sensor; the toolkit assumes the cone.",
    )


def _cone_volume() -> Statement:
    half = PAPER_SENSOR.fov / 2
    exact = math.pi / 3 * PAPER_SENSOR.range_m**3 * math.tan(half) ** 2
    return Statement(
        "One sensor's cone holds 0.173 m³, by octree 0.17 m³.",
        f"{exact:.4f} m³ by the closed form; voxel counts in the table below",
        Verdict.AGREES if abs(exact - 0.173) < 1e-3 else Verdict.DIFFERS,
        "The closed form is π/3 h³ tan²(12.5°), and the unbiased count agrees for every voxel up"
        " to 10 cm. Rule `touch` with voxels of 10 cm would give twice as much. This figure"
        " contradicts that rule, unless the paper used smaller voxels for it than for coverage;"
        " the paper does not say.",
    )


def _published_shares(tests: CoverageTests) -> Iterator[Statement]:
    """Yield the statements that give a percentage."""
    yield judged(
        f"n3_16_55 covers {PUBLISHED[str(NEAR)]:.2f} % of V_S(0.5).",
        tests.number("n3_16_55", NEAR, PUBLISHED[str(NEAR)], 2.5),
        {Verdict.UNDECIDED: _INFLATED, Verdict.DIFFERS: "No reading comes within 2.5 points."},
    )
    yield judged(
        f"n3_16_55 covers {PUBLISHED[str(FAR)]:.2f} % of V_S(1.5).",
        tests.number("n3_16_55", FAR, PUBLISHED[str(FAR)], 2.5),
        {
            Verdict.UNDECIDED: _INFLATED + " Of the two chains, the DH frames come nearest.",
            Verdict.DIFFERS: "",
        },
    )
    yield judged(
        "n3_16_55 covers over 65 % of every target.", tests.over_all, {Verdict.UNDECIDED: _INFLATED}
    )
    yield judged(
        "n2_16_55 covers over 90 % of V_S(0.5).",
        tests.over("n2_16_55", NEAR, 90),
        {Verdict.UNDECIDED: _INFLATED},
    )


def _growth(tests: CoverageTests) -> Iterator[Statement]:
    """Yield the statements that compare setups of more and fewer sensors and rings."""
    yield judged(
        "Coverage grows with sensors per ring and rings per link: n1_8_0, n1_16_0, n2, n3.",
        tests.grows,
        {
            Verdict.AGREES: "For every target, with n2_16_25 for n2.",
            Verdict.UNDECIDED: "With n2_16_25 for n2 it holds except where marked.",
        },
    )
    yield judged(
        "Every n2_16_θ of the bar chart covers more than n1_16_0.",
        tests.every_two,
        {Verdict.AGREES: "For every target."},
    )
    yield judged(
        "n2_16_10 covers about what n1_16_0 does, as the cones of its two rings overlap.",
        tests.alike,
        {
            Verdict.DIFFERS: (
                "The cones of its two rings overlap only partly, and it has 80 sensors"
                " instead of 48."
            ),
            Verdict.UNDECIDED: f"Within {NEAR_SAME:g} points except where marked.",
        },
    )


def _dip(tests: CoverageTests) -> Iterator[Statement]:
    """Yield the statements on n2_16_10 in the sweep of tilts."""
    yield judged(
        "n2_16_10 lies below n2_16_0 and n2_16_25.",
        tests.dip,
        {
            Verdict.AGREES: "For every target.",
            Verdict.UNDECIDED: "For every target except where marked: the dip of V_S(0.5) is flat.",
        },
    )
    yield judged(
        "n2_16_10 is the lowest of the sweep.",
        tests.lowest,
        {
            Verdict.DIFFERS: (
                "Every curve has a dip between 0° and 25°, closest to 15°. But V_S(1.5) falls"
                " below it at the steepest tilts, where beams point along the arm."
            ),
            Verdict.UNDECIDED: (
                "There is a dip between 0° and 25°; whether it is the minimum depends on the"
                " target."
            ),
        },
    )


def _best_tilts(tests: CoverageTests) -> Iterator[Statement]:
    """Yield the statements on the best tilts for the far and the near zone."""
    yield judged(
        "The far zone is covered best at 0° and 25°.",
        tests.far_best,
        {
            Verdict.AGREES: ("V_S(1.5) has its maximum at 0° and a second peak within 5° of 25°."),
            Verdict.UNDECIDED: (
                "V_S(1.5) has its maximum at or near 0°. Its second peak is broad and lies at 30°"
                " to 35°."
            ),
            Verdict.DIFFERS: "The second peak of V_S(1.5) lies elsewhere.",
        },
    )
    yield judged(
        "Near coverage grows with θ.",
        tests.near_grows,
        {
            Verdict.AGREES: "It falls slightly from 0° to the dip, then grows.",
            Verdict.UNDECIDED: (
                "It falls slightly from 0° to the dip, then grows; by rule `touch` it falls again"
                " from 55°."
            ),
        },
    )
    yield judged(
        "Conclusion: 25° and 0° are optimal for the closer and the farther region.",
        tests.near_best,
        {
            Verdict.DIFFERS: (
                "For the far region see above. For the near region the paper's own trend"
                " contradicts this, and so do all tests: near coverage is best at the steepest"
                " tilts, and 25° is far below."
            ),
        },
    )
