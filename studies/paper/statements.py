"""The paper's statements, the measurements here, and whether the two agree.

The paper does not state its frames, pose and voxels. Every statement is therefore tested in four
ways: on both UR10 chains, each counted without bias (`centre`, 1 cm) and by touched voxels of 10
cm. It *agrees* if all tests pass and *differs* if none passes. Otherwise it *cannot be decided*,
and the reason names the tests that pass.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from .coverage_cells import CHAINS, COUNTS


class Verdict(Enum):
    """Verdict on a statement; its value is the text on the page."""

    AGREES = "agrees"
    DIFFERS = "differs"
    UNDECIDED = "cannot be decided"


@dataclass(frozen=True)
class Statement:
    """A statement of the paper with its verdict."""

    said: str
    """The published statement."""
    found: str
    """The measurements here."""
    verdict: Verdict
    """Whether they agree."""
    why: str
    """Reason of the verdict."""


RULE_NAMES = {"centre": "unbiased", "touch": "touched"}
Reading = tuple[str, str]  # chain, rule
Measurement = tuple[str, bool]  # as text, and whether it agrees with the statement
Test = Callable[[Reading], Measurement]


def judged(
    said: str,
    test: Test,
    why: dict[Verdict, str],
    readings: Sequence[Reading] | None = None,
) -> Statement:
    """Test a statement in all readings.

    Args:
        said: the published statement.
        test: returns for a reading the measurement as text, and whether it agrees.
        why: reasons by verdict.
        readings: chains and rules to test; all four by default.
    """
    asked = readings or [(chain, rule) for rule, _ in COUNTS for chain in CHAINS]
    answers = {reading: test(reading) for reading in asked}
    held = sum(agrees for _, agrees in answers.values())
    verdict = (
        Verdict.AGREES
        if held == len(asked)
        else Verdict.DIFFERS
        if held == 0
        else Verdict.UNDECIDED
    )
    parts = [
        f"{chain} {RULE_NAMES[rule]} {text}{'' if ok else ' ✗'}"
        for (chain, rule), (text, ok) in answers.items()
    ]
    return Statement(said, "; ".join(parts), verdict, why.get(verdict, ""))
