"""Options of detection: which test piece, how fast, by how many sensors."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Group, Parameter

from ...coverage.definitions.errors import InputError, UserError, shown
from .groups import NO_SENSOR, SensorOptions
from .offered import explained

if TYPE_CHECKING:  # imported when the options are resolved
    from ...coverage.detection.detection import Detection

DETECTION = Group("Detection", sort_key=5)


@Parameter(name="*", group=DETECTION)
@explained
@dataclass(frozen=True)
class DetectionOptions:
    """A test piece that sensors must notice. Its light and its reflectance are those of the
    sensor's options, ``--ambient`` and ``--reflectance``."""

    detect: str | None = None
    """Test piece that sensors must notice in time, PIECE[:SECONDS], such as hand or rod-40:0.5. The
    piece is hand, arm, leg, torso, person, rod-DIAMETER in mm, or WIDTHxHEIGHT in metres;
    --reflectance replaces its reflectance. Default: 0.2 s. A search maximises the expected share of
    the targets in which it is noticed."""
    detected_by: int | None = None
    """Number of sensors that must notice the test piece. Default: 1."""
    crosstalk: float | None = None
    """Light that a cover glass throws back, as a share of the light from a target at the sensor's
    stated range that fills the beam, from 0 to 1. Default: that of the sensor's file, or 0."""

    detection_rates: Path | None = None
    """Detection rates that you measured (CSV: distance_m, reflectance, rate, frames; sensor,
    ambient, width_m, height_m if they matter), which take the place of the law."""

    def resolve(self, sensing: SensorOptions = NO_SENSOR) -> "Detection | None":
        """Return the question that the options state, or None without ``--detect``.

        Raises:
            UserError: for a value that is not allowed, or an option that belongs to ``--detect``
                without it.
        """
        if self.detect is None:
            for name in ("detected_by", "crosstalk", "detection_rates"):
                if (value := getattr(self, name)) is not None:
                    option = f"--{name.replace('_', '-')}"
                    raise UserError(f"{option} {value}: allowed only with --detect")
            return None
        if sensing.target_size is not None:
            raise UserError(
                f"--target-size {sensing.target_size}: not with --detect, whose test piece has a"
                f" size; for another size, --detect {sensing.target_size}"
            )
        return self._stated(sensing)

    def _stated(self, sensing: SensorOptions) -> "Detection":
        from ...coverage.detection.detection import Detection
        from ...formats.detection_rates import read_rates

        piece, colon, seconds = (self.detect or "").partition(":")
        try:
            within = float(seconds) if colon else None
        except ValueError:
            line = f"--detect: found {shown(seconds)}, allowed: PIECE:SECONDS with a number"
            raise UserError(line) from None
        given: dict[str, Any] = {
            "piece": piece,
            "reflectance": sensing.reflectance,
            "ambient": sensing.ambient,
            "seconds": within,
            "at_least": self.detected_by,
            "crosstalk": self.crosstalk,
            "rates": None if self.detection_rates is None else read_rates(self.detection_rates),
        }
        try:
            return Detection(**{k: v for k, v in given.items() if v is not None})
        except InputError as error:
            options = {"piece": "--detect", "seconds": "--detect", "at_least": "--detected-by"}
            key = error.argument.removeprefix("Detection: ")
            raise UserError(f"{options.get(key, f'--{key}')}: {error.line}") from error


NO_DETECTION = DetectionOptions()
