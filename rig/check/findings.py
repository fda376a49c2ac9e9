"""Text of the findings: differences from the proposal, and missing data."""

from collections.abc import Mapping, Sequence

import numpy as np

from .doubt import KINDS, MOST
from .line_findings import code_findings
from .models import CoverageModel, LineModel, MountCheckModel
from .part_results import PartResults
from .planned_check import ring_names
from .port_matching import text
from .self_check import sensor_names

_DOUBTS = {
    "failed": "fail",
    "missing": "miss their target",
    "near": "read less than 5 cm or their own least distance where nothing is expected",
    "apart": "jump away from their usual distance, although the robot stands still",
    "absent": "send nothing although others of their ring do",
    "together": "fail, miss their target, read too near or send nothing",
}
_NOT_BEGUN = "not finished before the check ended"


def differences(
    done: PartResults,
    mount: MountCheckModel | None,
    coverage: Sequence[CoverageModel],
    ports: Sequence[LineModel],
) -> list[str]:
    """List the differences between rig and proposal; ``ports`` are the rings' lines as given."""
    lines, looks, setup = list[str](), done.self_check, done.check.setup
    if done.ports:
        lines.append(text(done.ports, ring_names(setup), [port.port for port in ports]))
    lines += [
        f"{setup.group_name(i)}: the board {port.serial} answers, the proposal names {ring.serial}"
        for i, (ring, port) in enumerate(zip(setup.rings, ports, strict=False))
        if i not in done.ports and ring.serial and port.serial not in (None, ring.serial)
    ]
    if done.cell_turned:
        lines.append(
            "the readings fit the cell turned by 180° about the base's z axis: its obstacles are"
            " stated in another frame, as the pendant's feature Base is; negate x and y of each"
            " centre, and add 180° to the third of rpy_deg"
        )
    lines += [
        f"{setup.group_name(i)}: its frames hold {zones} zones of each sensor, not {wanted}: set"
        " the resolution in the firmware, or name the sensor's mode in the proposal"
        for i, (zones, wanted) in done.grids.items()
    ]
    if done.frozen:
        lines.append(f"sensors with zones that read the same everywhere: {', '.join(done.frozen)}")
    lines += code_findings(setup, ports)[0]
    if looks is not None:
        judged = mount is not None or done.cell_turned
        surprising = list[str]() if judged else looks.named(looks.surprising)
        for words, names, between in (
            ("sensors that never answer", looks.named(looks.silent), ", "),
            ("sensors that scatter more than expected", looks.named(looks.noisy), ", "),
            ("zones (row, column) that never answer", looks.silent_zones, "; "),
            ("zones (row, column) that are blocked: clean or clear", looks.blocked_zones, "; "),
            ("sensors that differ from the expected reading", surprising, ", "),
        ):
            if names:
                lines.append(f"{words}: {between.join(names)}")
    lines += [fault for ring in done.timing for fault in ring.faults]
    lines += _doubts(done)
    lines += [
        f"{setup.group_name(ring)}, by a hand: {fault}"
        for ring, waving in done.waves.items()
        for fault in waving.faults()
    ]
    if mount is not None:
        lines += [f"ring {r.ring} ({r.link}): {fault}" for r in mount.rings for fault in r.faults]
    for trials in coverage:
        lines += [f"{said} ({trials.named})" for said in trials.contradicted]
        if not trials.agrees:
            predicted = f"predicted: {trials.predicted_percent:.1f} %"
            lines.append(f"the rod was seen in {trials.measured} of {trials.named}, {predicted}")
    return lines


def _doubts(done: PartResults) -> list[str]:
    """List the sensors with doubtful readings, kind by kind; those that never answer are named by
    the self check and the mount check.
    """
    if done.doubt is None:
        return []
    counts = done.doubt.found
    if done.self_check is not None or done.built is not None:
        counts[:, done.doubt.shares[0] == 1] = False
    return [
        f"sensors that {_DOUBTS[kind]} in more than {100 * MOST:.0f} % of their readings: "
        + ", ".join(
            f"{name} ({100 * shares[k]:.0f} %)"
            for name, k in zip(sensor_names(done.check.setup, which), which, strict=True)
        )
        for kind, shares, sensors in zip(KINDS, done.doubt.shares, counts, strict=True)
        if len(which := np.flatnonzero(sensors))
    ]


def missing(
    done: PartResults,
    mount: MountCheckModel | None,
    coverage: Sequence[CoverageModel],
) -> tuple[list[str], bool]:
    """List the planned parts that could not be assessed, or only partly.

    Args:
        done: results of the parts.
        mount: result of the mount check.
        coverage: result of the coverage check, target by target.

    Returns:
        The findings, and whether too much is missing for a verdict.
    """
    plans, setup = done.check.plans, done.check.setup
    lines, waves, stops = list[str](), done.waves, len(done.stops)
    if plans.wave and len(waves) < len(setup.groups):
        what = "rings and single sensors" if setup.singles else "rings"
        lines.append(f"a hand was passed over {len(waves)} of {len(setup.groups)} {what}")
    lines += [
        f"{setup.group_name(ring)}, by a hand: no hand was seen by {', '.join(map(str, w.missed))}"
        for ring, w in waves.items()
        if w.missed
    ]
    if done.cut_short is not None:
        wanted = plans.seconds or 0.0
        lines.append(f"self check: cut off after {done.cut_short:.1f} of {wanted:g} s")
    lines += [text for ring in done.timing for text in ring.open]
    planned = 0 if plans.mount is None else len(plans.mount.joints)
    if stops < planned:
        why = _why(set(range(planned)) - set(done.stops), done.skipped_stops, "stop")
        lines.append(f"mount check: {stops} of {planned} stops were read; {why}")
    poses = f"; {_why(set(done.skipped_poses), done.skipped_poses, 'pose')}" * bool(
        done.skipped_poses
    )
    lines += [
        f"coverage check: {one.trials} of {one.planned} trials in {one.named} were completed{poses}"
        for one in coverage
        if one.trials < one.planned
    ]
    nothing = (
        (plans.seconds is not None and done.self_check is None)
        or (plans.wave and not waves)
        or (plans.mount is not None and mount is None and not done.cell_turned)
        or len(coverage) < len(plans.rods)
    )
    few = 2 * stops < planned
    if mount is not None:
        lines += [f"ring {r.ring} ({r.link}): {line}" for r in mount.rings for line in r.open]
    return lines, nothing or few or any(2 * one.trials < one.planned for one in coverage)


def _why(left: set[int], skipped: Mapping[int, str], what: str) -> str:
    """Say why each of the numbers in ``left`` is missing, reason by reason."""
    reasons: dict[str, list[int]] = {}
    for number in sorted(left):
        reasons.setdefault(skipped.get(number, _NOT_BEGUN), []).append(number)
    return "; ".join(
        f"{what}{'s' * (len(each) > 1)} {', '.join(map(str, each))}: {why}"
        for why, each in reasons.items()
    )
