"""Coverage of dark clothing: the same setup with the range that its sensors have on a dark target.

The range that a maker states first holds for a white target. ``effective_range`` derives that for a
target of 17 %, the reflectance of dark clothing in makers' data sheets, at the sensor's own light.
"""

from collections.abc import Sequence
from dataclasses import replace

from ..coverage.rings.ring import Setup
from ..coverage.sensors.sensor import Sensor, effective
from ..coverage.targets.target import Target
from .verified import Verified
from .verify import Verifier

REFLECTANCE = 0.17
"""Reflectance of dark clothing; a darker target that the sensor's use states stays."""


def in_dark_clothing(setup: Setup) -> Setup | None:
    """Return the setup with its sensors' ranges on dark clothing; None if one of its sensors has no
    figures of a catalogue or a sensor file, or if it has no sensor."""
    if not setup.sensors or any(group.sensor.use is None for group in setup.groups):
        return None
    return setup.with_sensors(_dark)


def _dark(sensor: Sensor) -> Sensor:
    if sensor.use is None:
        return sensor
    reflectance = min(REFLECTANCE, sensor.use.reflectance or 1.0)
    use = replace(sensor.use, reflectance=reflectance)
    return replace(sensor, range_m=min(effective(use).range_m, sensor.range_m), use=use)


def verify_dark(verifier: Verifier, setup: Setup, target: Target) -> Verified | None:
    """Return ζ of ``setup`` for dark clothing, counted on the verifier's own voxels.

    It is None as ``in_dark_clothing`` says, and under the rule ``certified``: an interval holds for
    one range only. A sensor of the cell without figures of its own keeps its stated range.
    """
    dark = None if verifier.rule == "certified" else in_dark_clothing(setup)
    if dark is None:
        return None
    cell = Setup((), verifier.scene.cell_sensors).with_sensors(_dark).singles
    return verifier.in_scene(replace(verifier.scene, cell_sensors=cell)).verify(dark, target)


def judge_dark(verifier: Verifier, each: Sequence[Verified | None]) -> float | None:
    """Return the mean over the goals of a scene, or ζ of its worst pose, as ``Verifier.judged``."""
    known = [one for one in each if one is not None]
    return verifier.judged(known)[1] if len(known) == len(verifier.scene.targets) else None
