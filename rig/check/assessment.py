"""Assessment of a check: results of its parts, differences from the proposal, and the verdict. Live
data and recordings use the same code.
"""

import time
from dataclasses import dataclass
from typing import Literal

from ...objectives.verify import Verifier
from ...objectives.verify_breakdown import calibration_effect
from .check_data import CheckData
from .findings import differences, missing
from .models import CheckResult
from .part_results import PartResults
from .records import (
    coverage_of,
    events_of,
    lines_of,
    link_of,
    mount_of,
    seconds_of,
    self_check_of,
    sensors_of,
    warnings_of,
)


@dataclass(frozen=True)
class Assessment:
    """Assessment of a rig."""

    result: CheckResult
    """The verdict and all data of the report."""
    parts: PartResults
    """Results of the parts that the verdict is based on."""
    verifier: Verifier
    """Verifier of the scene at the check's voxel size."""


def assess(data: CheckData) -> Assessment:
    """Assess a check by the data received."""
    check, gathered = data.check, data.gathered
    done, setup = PartResults(check, gathered), check.setup
    verifier = Verifier(check.scene, check.voxel)
    mount = mount_of(check, len(done.stops), done.built, verifier)
    coverage = [coverage_of(check, rod, done.built) for rod in done.rods]
    lines = lines_of(setup, check.ports, gathered)
    differs = differences(done, mount, coverage, lines)
    lacks, too_much = missing(done, mount, coverage)
    ended = next((str(n.get("why")) for n in gathered.notes("ended")), "it was cut off")
    early = [f"ended early: {ended}"] if ended else []
    verdict: Literal["as proposed", "differs", "unfinished"] = "as proposed"
    if ended or too_much:
        verdict = "unfinished"
    elif differs:
        verdict = "differs"
    elif mount is not None and any(ring.open for ring in mount.rings):
        verdict = "unfinished"
    result = CheckResult(
        setup=check.name,
        simulated=check.simulated,
        faults=check.faults,
        seed=check.seed,
        recorded=time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(data.wall)),
        seconds=seconds_of(gathered),
        verdict=verdict,
        reasons=[*early, *done.failures, *differs, *lacks],
        warnings=warnings_of(setup, gathered, data.damage, lines),
        robot=link_of(gathered),
        lines=lines,
        events=events_of(gathered),
        sensors=sensors_of(setup, done.doubt),
        cell_turned=done.cell_turned,
        self_check=self_check_of(done.self_check, done.waves),
        timing=done.timing,
        mount=mount,
        coverage=coverage,
        calibration=calibration_effect(verifier, setup),
        version=check.version,
    )
    return Assessment(result, done, verifier)
