"""The options of a simulation of approaches, for Python and the command."""

from dataclasses import dataclass
from typing import Annotated

from ..coverage.definitions.options import Draws, Number, Options, Seed, Whole
from ..coverage.occlusion.occlusion_mode import Occlusion


@dataclass(frozen=True, kw_only=True)
class SafetyOptions(Options):
    """How approaches are drawn and reported."""

    approaches: Draws = 720
    """Number of simulated approaches."""
    directions: Annotated[int, Whole(1, 360)] = 12
    """Number of sectors around the robot in the report."""
    rate: Annotated[float | None, Number("Hz, above 0, at most 10,000", gt=0, le=10_000)] = None
    """Measurements per second. Default: those of the ring's bus or the sensor, or 20."""
    latency: Annotated[float, Number("s, 0 to 5", ge=0, le=5)] = 0.02
    """Time from a measurement to its report, in seconds."""
    occlusion: Occlusion | None = None
    """What the robot's body does to the sensors. ignore: beams pass through it. shadow: points
    behind it are not covered. blind: a one-zone sensor covers nothing beyond the nearest surface in
    its beam. Default: that of the scene, with shadow instead of ignore."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""
