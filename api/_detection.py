"""Detection rates that a user has measured."""

from pathlib import Path

from ._errors import input_errors
from .coverage.detection.measured_rates import RateTable
from .formats.detection_rates import read_rates


def detection_rates(path: str | Path) -> RateTable:
    """Return measured detection rates, for ``pr.Detection(rates=...)``.

    Args:
        path: CSV file with the columns ``distance_m``, ``reflectance``, ``rate`` (share of the
            frames that reported the target) and ``frames`` (their number), and if they matter
            ``sensor``, ``ambient``, ``width_m`` and ``height_m`` of the target.

    Raises:
        InputError: if the file cannot be read or a row is not valid.

    Example:
        >>> import place_rings as pr
        >>> from pathlib import Path
        >>> lines = ["distance_m,reflectance,rate,frames", "0.2,0.018,1.0,500", "0.4,0.018,0,500"]
        >>> _ = Path("rates.csv").write_text("\\n".join(lines))
        >>> pr.Detection("arm", rates=pr.detection_rates("rates.csv")).piece.name
        'arm'
    """
    with input_errors("path"):
        return read_rates(Path(path))
