"""What speaks against a rig's being as proposed, and what is missing to say so, in words."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..mount.as_built import AsBuilt
from ..mount.model import LIMITS, NAMES
from ..mount.waving import Waving
from .models import CoverageModel, MountCheckModel
from .plans import Plans
from .self_check import SelfCheck


def differences(
    looks: SelfCheck | None,
    waves: Mapping[int, Waving],
    mount: MountCheckModel | None,
    coverage: Sequence[CoverageModel],
    built: AsBuilt | None,
) -> list[str]:
    """In what the rig is other than proposed."""
    found = []
    if looks is not None:
        if len(looks.silent):
            found.append(f"sensors that never answer: {', '.join(looks.named(looks.silent))}")
        if len(looks.noisy):
            found.append(
                f"sensors that scatter more than thought: {', '.join(looks.named(looks.noisy))}"
            )
        if len(looks.surprising) and mount is None:
            found.append(
                f"sensors that read other than expected: {', '.join(looks.named(looks.surprising))}"
            )
    found += [
        f"ring {ring}, by a hand: {fault}"
        for ring, waving in waves.items()
        for fault in waving.faults()
    ]
    if mount is not None and built is not None:
        found += [f"ring {r.ring} ({r.link}) {fault}" for r in mount.rings for fault in r.faults]
        for i, fit in enumerate(built.fits):
            limit = LIMITS[[NAMES.index(name) for name in fit.names]]
            beyond = np.abs(fit.values) > limit + fit.margins()
            found += [
                f"ring {i} ({fit.nominal.link}) is off by more than a careful mount: {fit.names[k]}"
                for k in np.flatnonzero(beyond)
            ]
    for one in coverage:
        if not one.agrees:
            was = f"{one.measured_percent:.1f} % ({one.low_percent:.1f} to {one.high_percent:.1f})"
            found.append(
                f"the rod was seen in {was} of {one.named}, predicted:"
                f" {one.predicted_percent:.1f} %"
            )
    return found


def missing(
    plans: Plans,
    looks: SelfCheck | None,
    waves: Mapping[int, Waving],
    rings: int,
    mount: MountCheckModel | None,
    stops: int,
    coverage: Sequence[CoverageModel],
) -> tuple[list[str], bool]:
    """What was asked for and is not judged, or only in part, of a setup of so many ``rings`` of
    which so many ``stops`` were read; and whether that is too much for a verdict."""
    found = []
    if plans.wave and len(waves) < rings:
        found.append(f"a hand was passed over {len(waves)} of {rings} rings")
    found += [
        f"ring {ring}, by a hand: none was seen by {', '.join(map(str, w.missed))}"
        for ring, w in waves.items()
        if w.missed
    ]
    planned = 0 if plans.mount is None else len(plans.mount.joints)
    if stops < planned:
        found.append(f"mount check: {stops} of {planned} stops were read")
    found += [
        f"coverage check: {one.trials} of {one.planned} trials in {one.named} were done"
        for one in coverage
        if one.trials < one.planned
    ]
    nothing = (
        (plans.seconds is not None and looks is None)
        or (plans.wave and not waves)
        or (plans.mount is not None and mount is None)
        or len(coverage) < len(plans.rods)
    )
    few = 2 * stops < planned
    return found, nothing or few or any(2 * one.trials < one.planned for one in coverage)
