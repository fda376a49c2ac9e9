"""What sensors of the catalogue draw, where a source says so. No price is sourced for any of them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Supply:
    """Electrical power of one sensor at work, W; whether the source has it as a limit or as typical; and the source."""

    power_w: float
    limit: bool
    source: str


SUPPLIES = {
    "tfmini": Supply(0.6, True, "Benewake, SJ-GU-TFmini-T-01 A02, average power"),
    "tfmini-s": Supply(0.7, True, "Benewake, SJ-GU-TFmini-S-01 A00"),
    "tfmini-plus": Supply(0.55, False, "Benewake, SJ-GU-TFmini-Plus-01 A04"),
    "vl53l8cx": Supply(0.215, False, "ST, DS14161, continuous, as quoted by a third party"),
}
