"""Models of the result of a check (``check.json``, ``check --json``)."""

from typing import Literal

from pydantic import Field

from ...coverage.choices import Faults
from ...coverage.targets.target import key_text
from ...formats.schema.base_model import Percent, StrictModel
from ...objectives.verified import CalibrationEffect
from ..mount.as_built import ZetaModel
from ..mount.fit_record import RingFitModel

DISCLAIMER = (
    "place-rings is an engineering aid. A check is no safety function and confers no safety rating:"
    " the robot's own safety functions protect people near the robot; nothing in the check"
    " does."
)


class LinkModel(StrictModel):
    """Link to the robot: number of states and their duration, the robot's clock relative to the
    host's, and why the link ended, if it did.
    """

    states: int
    seconds: float
    drift_ppm: float | None = None
    jitter_ms: float | None = None
    ended: str | None = None


class LineModel(StrictModel):
    """Line of a ring: frames used and frames spoiled by kind; the ring's clock relative to the
    host's; the serial number of the board that said hello, null if none did.
    """

    ring: int
    link: str
    port: str
    decoder: str
    frames: int
    lost: int
    late: int
    corrupt: int
    restarts: int
    foreign: str | None = Field(
        default=None, description="the first line of text outside the decoder's grammar, quoted"
    )
    unknown_codes: dict[str, dict[str, float]] = Field(
        default={},
        description="percent of each sensor's frames with a status code that the decoder does not"
        " know, or knows in another sense than the likely chip, by sensor and code",
    )
    codes_of: str | None = Field(default=None, description="chips that seem to send these codes")
    serial: str | None = None
    drift_ppm: float | None = None
    jitter_ms: float | None = None

    @property
    def board(self) -> str:
        """The board's serial number."""
        return self.serial or "none"


class EventModel(StrictModel):
    """Event of a ring's line; ``seconds`` counts from the start of the recording."""

    seconds: float
    ring: int
    what: str
    detail: str = ""


class LookModel(StrictModel):
    """Result of a ring in the self check; sensors are named ring:sensor."""

    ring: int
    frames: int
    rate_hz: float
    gaps: int
    answering: int
    scatter_mm: float | None = None


class WavingModel(StrictModel):
    """Result of passing a hand over a ring: the seat of each place in its frames, null where the
    sensor saw no hand.
    """

    ring: int
    seats: list[int | None]
    faults: list[str]
    missed: list[int]


class SelfModel(StrictModel):
    """Result of the self check; zones are named ring:sensor (row, column)."""

    rings: list[LookModel]
    silent: list[str]
    noisy: list[str]
    lossy: list[str]
    on_robot: list[str]
    surprising: list[str]
    silent_zones: list[str] = Field(default=[])
    blocked_zones: list[str] = Field(default=[])
    waved: list[WavingModel] = Field(default=[])


class TimingModel(StrictModel):
    """Frames of a ring beside those of its firing schedule. ``late_ms`` says how much later than
    those of ring ``reference`` its cycles begin; null if it shares no slots.
    """

    ring: int
    cycle_ms: float = Field(description="time between two readings of a sensor, by the schedule")
    wanted_hz: float = Field(description="frames per second, by the schedule")
    found_hz: float | None = None
    late_ms: float | None = None
    reference: int | None = None
    seen: int = Field(description="number of sensors whose readings show when they range")
    outside: list[int] = Field(description="sensors that range outside of their slots")
    repeating: list[int] = Field(description="sensors without a new reading in most slots")
    faults: list[str]
    open: list[str] = Field(description="what could not be compared, and why")

    @property
    def named(self) -> str:
        """The sensors outside of their slots or without new readings."""
        return ", ".join(map(str, sorted({*self.outside, *self.repeating})))


class SensorHealthModel(StrictModel):
    """Doubtful readings of a sensor while the robot stood still, in percent of its readings: in the
    part of the check that has the most. A sensor is doubtful if one of them is above 20 %.
    """

    sensor: str
    readings: int
    failed_percent: Percent
    missing_percent: Percent = Field(description="without a sure distance, where it has a target")
    near_percent: Percent = Field(description="below 5 cm, or its least range, unexpectedly")
    apart_percent: Percent = Field(description="valid, but outside the cluster of most distances")
    absent_percent: Percent = Field(description="not sent, although others of its ring are")
    together_percent: Percent = Field(description="failed, missing, near or absent")
    doubtful: bool


class MountCheckModel(StrictModel):
    stops: int
    planned: int
    rings: list[RingFitModel]
    zeta: list[ZetaModel]
    injected_found: dict[str, bool] | None = None


class CoverageModel(StrictModel):
    """Trials with the rod in a target.

    ``table`` counts trials: rows predicted seen and unseen, columns observed seen and unseen;
    ``edge`` those predicted seen and unseen that are near the edge of coverage, ``beyond`` those
    beyond the target. The percentages are of the target: measured, predicted for the proposal and,
    after a mount check, for the setup as built.
    """

    target: str
    radius: float | None = None
    rod_mm: list[float]
    trials: int
    planned: int
    testable_percent: Percent
    table: list[list[int]]
    edge: list[int]
    beyond: int
    contradicted: list[str] = Field(
        description="on which side of the edge of coverage the trials contradict the prediction"
    )
    predicted_percent: Percent
    built_percent: Percent | None = None
    true_percent: Percent | None = Field(default=None, description="of a simulated rig, counted")
    measured_percent: Percent
    low_percent: Percent
    high_percent: Percent
    agrees: bool

    @property
    def named(self) -> str:
        """The target."""
        return key_text(self.target, self.radius)

    @property
    def measured(self) -> str:
        """The measured share with its interval."""
        interval = f"{self.low_percent:.1f} to {self.high_percent:.1f}"
        return f"{self.measured_percent:.1f} % ({interval})"


class CheckResult(StrictModel):
    """Result of a check, as ``check --json`` prints it.

    ``verdict`` is ``as proposed``, ``differs`` or ``unfinished``. ``warnings`` lists reasons to
    distrust it. ``faults`` says what was wrong with a simulated rig.
    """

    setup: str
    simulated: bool
    faults: Faults = "random"
    seed: int
    recorded: str
    seconds: float
    verdict: Literal["as proposed", "differs", "unfinished"]
    reasons: list[str]
    warnings: list[str]
    robot: LinkModel
    lines: list[LineModel]
    events: list[EventModel]
    sensors: list[SensorHealthModel] = Field(default=[])
    cell_turned: bool = Field(
        default=False, description="whether the readings fit the cell turned by 180° about z"
    )
    self_check: SelfModel | None = None
    timing: list[TimingModel] = Field(default=[], description="with a firing schedule")
    mount: MountCheckModel | None = None
    coverage: list[CoverageModel] = Field(default=[])
    calibration: list[CalibrationEffect] = Field(
        default=[], description="what the arm's calibration changes, for each target"
    )
    version: str
    disclaimer: str = DISCLAIMER
