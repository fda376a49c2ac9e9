"""Zeta of detection as a table and as lines, for the terminal and the report."""

from collections.abc import Sequence

from ...coverage.detection.detection import WHITE, Detection
from ...coverage.rings.ring import Setup
from ...objectives.detected import Detected, PoseDetected
from ...objectives.scene import Scene
from ...objectives.verified import Verified
from ..explained import Explained
from ..tables import percent, target_label
from ..text import with_error

_SHOWN = 16  # largest number of poses of which each is printed

COLUMNS = ("target", "ζ", "ζ of detection", "by the assumptions", "law")
MEANING = (
    "ζ of detection: the expected share of the target in which the piece is detected, by a law of"
    " signal and noise that meets the sensors' stated ranges; it is not measured."
)
_LEGEND = (
    f"{MEANING} by the assumptions: what figures that no source states leave open; this is no error"
    " of the count. law: the error of the law itself, in points; it held 95 % of the questions that"
    " it was taken from, of place-rings study detection."
)


def question_text(question: Detection) -> str:
    """Return a question of detection as text: hand of 80 × 180 mm, 17 % reflectance, ..."""
    piece, at_least = question.piece, question.at_least
    size = f"{1000 * piece.width_m:g} × {1000 * piece.height_m:g} mm"
    light = "" if question.ambient is None else f", light {question.ambient}"
    by = "" if at_least == 1 else f" by {at_least} or more sensors"
    return (
        f"{piece.name} of {size}, {100 * question.rho:.3g} % reflectance{light},"
        f" within {question.seconds:g} s{by}"
    )


def detected_text(d: Detected | PoseDetected) -> str:
    """Return zeta of detection in percent, with the error of its count or as an interval."""
    if d.low is not None and d.high is not None:
        return f"{100 * d.low:.2f} … {100 * d.high:.2f}"
    return with_error(100 * d.zeta, d.error)


def open_text(d: Detected) -> str:
    """Return what the law's assumptions leave open, in percent; a dash beside an interval."""
    ends = d.assumed_low, d.assumed_high
    return " … ".join(f"{100 * end:.2f}" for end in ends if end is not None) or "–"


def detection_rows(results: Sequence[Verified]) -> list[tuple[str, ...]]:
    """Return the rows of ``COLUMNS`` of the results with a question of detection."""
    rows = list[tuple[str, ...]]()
    for r in results:
        if (d := r.detection) is not None:
            known = detected_text(d), open_text(d), f"± {100 * d.law_error:g}"
            rows.append((target_label(r), percent(r, r.rule), *known))
    return rows


def detection_table(results: Sequence[Verified]) -> Explained | None:
    """Return the table of zeta of detection, if a question was asked."""
    if not (rows := detection_rows(results)):
        return None
    question = next(r.detection.question for r in results if r.detection is not None)
    title = f"Detection in percent: {question_text(question)}"
    return Explained.of(title, COLUMNS, rows, _LEGEND, left=COLUMNS[:1])


def detection_lines(results: Sequence[Verified], scene: Scene, setup: Setup) -> list[str]:
    """Return zeta of detection at each of few poses, the cells of an interval, and assumptions
    about sensors without figures."""
    lines = list[str]()
    for r in results:
        if (d := r.detection) is None:
            continue
        if 1 < len(d.poses) <= _SHOWN:
            each = ", ".join(map(detected_text, d.poses))
            lines.append(f"{target_label(r)}, detection at each pose, in percent: {each}")
        if d.cell is not None:
            lines.append(
                f"{target_label(r)}, detection: guaranteed to hold the law's value; cells of"
                f" {1000 * d.cell:g} mm, {d.seconds:.1f} s. Smaller cells (--voxel) give a narrower"
                " interval."
            )
    if lines or any(r.detection for r in results):
        sensors = {group.sensor for group in scene.with_cell(setup).groups}
        if any(sensor.use is None for sensor in sensors):
            lines.append(
                "Detection by sensors without figures of a catalogue is an assumption: their range"
                f" is taken for a target of {100 * WHITE:g} % reflectance, and the time for one"
                " reading. Set --sensor to a model."
            )
    return lines
