"""Texts of a page as HTML, with everything from files escaped."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from ..formats.escaping import printable
from ..formats.schema.result_models import VerifyResult
from ..reporting.tables import percent
from ..reporting.text import counted
from .colours import KINDS
from .tasks import Proof

IDEA = (
    "Rings of distance sensors around the arm cover <b>cones</b> of the space around it. The dots"
    " fill a <b>target</b> volume: blue dots are covered, orange dots are not. <b>ζ</b> is the"
    " covered share."
)
DISCLAIMER = "An engineering aid: it confers no safety rating."


@dataclass(frozen=True)
class TableRow:
    """Coverage of one target."""

    target: str
    """Label of the target."""
    values: tuple[tuple[float, float], ...]
    """ζ in [0, 1] of each setup, as opened and now."""


def _text(text: str) -> str:
    """Escape a text for HTML."""
    return escape(printable(text))


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of cells, which are escaped here; the first column is left-aligned."""
    side = ["left"] + ["right"] * (len(head) - 1)
    cell = "<{0} style='text-align:{1};padding:1px 6px;font-variant-numeric:tabular-nums'>{2}</{0}>"
    lines = ["".join(cell.format("th", s, _text(h)) for s, h in zip(side, head, strict=True))]
    lines += [
        "".join(
            cell.format("td", f"{s};white-space:nowrap", _text(c))
            for s, c in zip(side, row, strict=True)
        )
        for row in rows
    ]
    body = "".join(f"<tr>{x}</tr>" for x in lines)
    return f"<table style='font-size:13px;border-collapse:collapse'>{body}</table>"


def _box(text: str) -> str:
    return f"<div style='padding:2px 10px;font-size:13px;line-height:1.45'>{text}</div>"


def heading(names: Sequence[str], robot: str, sensors: Sequence[int], rings: Sequence[int]) -> str:
    """Return the setups on the page and an explanation of coverage."""
    each = (
        f"<b>{_text(n)}</b>: {counted(k, 'sensor')} on {counted(r, 'ring')}"
        for n, k, r in zip(names, sensors, rings, strict=True)
    )
    return _box(
        f"{'<br>'.join(each)}<br>robot {_text(robot)}<br><span style='color:#555'>{IDEA}</span>"
    )


def zeta_table(names: Sequence[str], rows: Sequence[TableRow], seconds: float, poses: str) -> str:
    """Return a table of ζ of all targets, as opened and now, in percent."""
    several = len(names) > 1
    head = ["ζ in %"]
    for name in names:
        head += [f"{name}, as opened", "now"] if several else ["as opened", "now"]
    cells = [[r.target, *(f"{100 * v:.1f}" for pair in r.values for v in pair)] for r in rows]
    note = f"<span style='color:#555'>estimated from points{_text(poses)}; {seconds:.2f} s</span>"
    return _box(_table(head, cells) + note)


def legend(shares: Sequence[float], target: str, where: str) -> str:
    """Return the legend of the points.

    Args:
        shares: share of the target's points in each class.
        target: label of the target.
        where: setup and pose.
    """
    dot = "<span style='color:{0};font-size:16px'>&#9679;</span> {2:.1f} % {1}"
    lines = (
        dot.format(k.colour, _text(k.words), 100 * s) for k, s in zip(KINDS, shares, strict=True)
    )
    return _box(f"Points of {_text(target)}{_text(where)}<br>" + "<br>".join(lines))


def proof_table(name: str, proofs: Sequence[Proof]) -> str:
    """Return a table of counts and guaranteed intervals."""
    rows = []
    for p in proofs:
        c, voxels = p.certified, p.counted
        of = "" if voxels.target_voxels is None else f"{voxels.target_voxels:,}"
        rows.append(
            [
                str(c.target),
                f"{100 * voxels.zeta:.2f}",
                of,
                percent(VerifyResult.of("", c), "certified"),
            ]
        )
    return _box(
        _text(name) + _table(["ζ in %", "counted", "target, cm³", "guaranteed interval"], rows)
    )


def note(text: str, bad: bool = False) -> str:
    """Return a line of plain text."""
    return (
        _box(f"<span style='color:{'#b00020' if bad else '#333'}'>{_text(text)}</span>")
        if text
        else ""
    )
