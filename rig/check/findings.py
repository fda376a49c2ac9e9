"""What speaks against a rig's being as proposed, and what is missing to say so, in words."""

from collections.abc import Sequence

import numpy as np

from ..mount.model import LIMITS, NAMES
from .models import CoverageModel, MountCheckModel
from .part_results import PartResults
from .plans import Plans


def differences(
    done: PartResults, mount: MountCheckModel | None, coverage: Sequence[CoverageModel]
) -> list[str]:
    """In what the rig is other than proposed."""
    lines, looks, built = list[str](), done.self_check, done.built
    if looks is not None:
        if len(looks.silent):
            lines.append(f"sensors that never answer: {', '.join(looks.named(looks.silent))}")
        if len(looks.noisy):
            lines.append(
                f"sensors that scatter more than thought: {', '.join(looks.named(looks.noisy))}"
            )
        if len(looks.surprising) and mount is None:
            lines.append(
                f"sensors that read other than expected: {', '.join(looks.named(looks.surprising))}"
            )
    lines += [
        f"ring {ring}, by a hand: {fault}"
        for ring, waving in done.waves.items()
        for fault in waving.faults()
    ]
    if mount is not None and built is not None:
        lines += [f"ring {r.ring} ({r.link}) {fault}" for r in mount.rings for fault in r.faults]
        for i, fit in enumerate(built.fits):
            limit = LIMITS[[NAMES.index(name) for name in fit.names]]
            beyond = np.abs(fit.values) > limit + fit.margins()
            lines += [
                f"ring {i} ({fit.nominal.link}) is off by more than a careful mount: {fit.names[k]}"
                for k in np.flatnonzero(beyond)
            ]
    for one in coverage:
        if not one.agrees:
            was = f"{one.measured_percent:.1f} % ({one.low_percent:.1f} to {one.high_percent:.1f})"
            lines.append(
                f"the rod was seen in {was} of {one.named}, predicted:"
                f" {one.predicted_percent:.1f} %"
            )
    return lines


def missing(
    plans: Plans,
    rings: int,
    done: PartResults,
    mount: MountCheckModel | None,
    coverage: Sequence[CoverageModel],
) -> tuple[list[str], bool]:
    """What was planned and could not be assessed, or only in part, of a setup of so many ``rings``;
    and whether that is too much for a verdict."""
    lines, waves, stops = list[str](), done.waves, len(done.stops)
    if plans.wave and len(waves) < rings:
        lines.append(f"a hand was passed over {len(waves)} of {rings} rings")
    lines += [
        f"ring {ring}, by a hand: none was seen by {', '.join(map(str, w.missed))}"
        for ring, w in waves.items()
        if w.missed
    ]
    planned = 0 if plans.mount is None else len(plans.mount.joints)
    if stops < planned:
        lines.append(f"mount check: {stops} of {planned} stops were read")
    lines += [
        f"coverage check: {one.trials} of {one.planned} trials in {one.named} were done"
        for one in coverage
        if one.trials < one.planned
    ]
    nothing = (
        (plans.seconds is not None and done.self_check is None)
        or (plans.wave and not waves)
        or (plans.mount is not None and mount is None)
        or len(coverage) < len(plans.rods)
    )
    few = 2 * stops < planned
    return lines, nothing or few or any(2 * one.trials < one.planned for one in coverage)
