"""Section of the dossier on what the sensors can detect."""

from collections.abc import Iterator

from ...simulation.dossier.capability import TargetCapability
from ...simulation.dossier.dossier import Dossier
from ..lines.detection import MEANING, detected_text, open_text, question_text
from ..lines.results import bounds_text, gap_verdict
from ..pages import escaped, table
from ..text import counted


def capability_section(d: Dossier) -> Iterator[str]:
    """Yield what the user verified, the largest unseen objects, and the expected shares with
    detection."""
    c, verified = d.capability, d.stated.detection_capability
    yield "## Detection capability and test piece\n"
    yield (
        "The effective detection capability d_e (ISO 13855:2024) is the size of the smallest object"
        " that is detected reliably. It needs a test piece and a test on the rig. Verified by the"
        f" user: {f'{escaped(verified)} (stated by the user)' if verified else '**open**'}.\n"
    )
    yield (
        "Computed values follow, for the targets of the scene at"
        f" {counted(c.moments, 'moment')} of {c.of_moments}; an object that is unseen at one of"
        " them counts as unseen.\n"
    )
    yield from _objects([t for t in c.targets if t.objects is not None])
    yield from _shares([t for t in c.targets if t.detection is not None])


def _objects(targets: list[TargetCapability]) -> Iterator[str]:
    if not targets:
        yield "Largest object that no sensor sees: **open**; `--smallest-object` bounds it.\n"
        return
    for t in targets:
        if (o := t.objects) is not None:
            rod = bounds_text(f"vertical rod of {o.rod_length:g} m", o.rod)
            verdict = "" if o.verdict is None else f" **{gap_verdict(o).capitalize()}.**"
            yield (
                f"- {escaped(t.target)}, unseen: {bounds_text('sphere', o.sphere)}; {rod}."
                f"{escaped(verdict)}"
            )
    yield (
        "\nBoth ends of each interval are proved, for nominal beams: a larger object meets a beam"
        " wherever its centre is in the target. That it is detected there is not proved.\n"
    )


def _shares(targets: list[TargetCapability]) -> Iterator[str]:
    if not targets:
        yield (
            "Expected share in which a test piece is detected: **open**; `--detect` computes it. A"
            " catalogue range holds for a target that fills the beam, unless a size is stated.\n"
        )
        return
    rows = []
    for t in targets:
        if (n := t.detection) is not None and t.proved is not None:
            row = (escaped(t.target), detected_text(n), open_text(n), detected_text(t.proved))
            rows.append(row)
            question = question_text(n.question)
    yield f"In percent, {escaped(question)}:\n"
    yield table(("target", "ζ of detection", "by the assumptions", "proved value of the law"), rows)
    yield f"{MEANING}\n"
