"""Records of changes to what is mounted, in degrees and millimetres."""

import math

from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import DIGITS_DEG
from ...coverage.sensors.sensor import Sensor
from ...placement.redesign.changes import Change, Work
from ..schema.proposal_models import ChangeModel, WorkModel
from .scenes import ring_models

_DIGITS_MM = 3  # decimals of a length in millimetres


def change_model(change: Change, mounted: int, sensor: Sensor) -> ChangeModel:
    """The record of a change to one of so many mounted rings; ``sensor`` is the scene's."""
    before, after = (
        None if ring is None else ring_models(Setup((ring,)), sensor)[0]
        for ring in (change.before, change.after)
    )
    return ChangeModel(
        ring=change.place if change.place < mounted else None,
        done=change.kind.value,
        before=before,
        after=after,
        sensors=change.sensors,
        moved_mm=_millimetres(change.moved),
        tilted_deg=round(math.degrees(change.tilted), DIGITS_DEG),
        turned_deg=round(math.degrees(change.turned), DIGITS_DEG),
    )


def work_model(work: Work) -> WorkModel:
    """The record of the work that changes are."""
    return WorkModel(
        rings_touched=work.rings,
        rings_carried=work.carried,
        sensors_added=work.sensors,
        moved_mm=_millimetres(work.moved),
        tilted_deg=round(math.degrees(work.tilted), DIGITS_DEG),
        turned_deg=round(math.degrees(work.turned), DIGITS_DEG),
    )


def _millimetres(length: float) -> float:
    return round(1000 * length, _DIGITS_MM)
