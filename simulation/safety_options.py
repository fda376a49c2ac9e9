"""The options of a simulation of approaches, for Python and the command."""

from dataclasses import dataclass
from typing import Annotated

from ..coverage.definitions.errors import InputError
from ..coverage.definitions.options import Draws, Number, Seed, Whole
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..objectives.options import ObjectOptions


@dataclass(frozen=True, kw_only=True)
class SafetyOptions(ObjectOptions):
    """How approaches are drawn and reported; those of unseen objects are for the dossier."""

    approaches: Draws = 720
    """Number of simulated approaches."""
    directions: Annotated[int, Whole(1, 360)] = 12
    """Number of sectors around the robot in the report."""
    rate: Annotated[float | None, Number("Hz, above 0, at most 10,000", gt=0, le=10_000)] = None
    """Measurements per second. Default: those of the ring's bus or the sensor, or 20."""
    scheduled: bool = False
    """Let no two sensors fire together that may disturb each other: each ring has the rate of its
    firing schedule (``place-rings schedule``), which replaces ``rate``."""
    latency: Annotated[float, Number("s, 0 to 5", ge=0, le=5)] = 0.02
    """Time from a measurement to its report, in seconds."""
    occlusion: Occlusion | None = None
    """What the robot's body does to the sensors. ignore: beams pass through it. shadow: points
    behind it are not covered. returns: a one-zone sensor that reports several targets covers only
    what lies at least the maker's separation behind each body in its beam, while it has targets
    left. blind: a one-zone sensor covers nothing beyond the nearest surface in its beam.
    Default: that of the scene, with shadow instead of ignore."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or a rate beside that of the schedule."""
        super().__post_init__()
        if self.scheduled and self.rate is not None:
            line = f"found {self.rate:g}, allowed: only without scheduled"
            raise InputError(line, "rate", others=("scheduled",))
