"""Texts of a page as HTML, with everything from files escaped."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ..coverage.definitions.escaping import printable
from ..reporting.tables import percent
from ..reporting.text import counted, with_error
from .colours import KINDS, LARGEST, SPHERES, WARNING, on_page
from .quick_estimate import SensorReport
from .tasks import Proof
from .unseen_spheres import UnseenSpheres

UNBUILDABLE = "Cannot be built by the scene's rules"
_FAINT = "opacity:.72"
_MOST_TOLD = 5  # violated rules that are listed

IDEA = (
    "Each dot is a sample of the target's volume. <b>Blue</b>: at least one sensor sees it."
    " <b>Orange</b> and shadowed: none does. <b>ζ</b> (coverage) is the blue share."
)
DISCLAIMER = "An engineering aid: it confers no safety rating."


@dataclass(frozen=True)
class TableRow:
    """Coverage of one target."""

    target: str
    """Label of the target."""
    values: tuple[tuple[float, float], ...]
    """ζ in [0, 1] of each setup, as opened and now."""
    dark: tuple[float | None, ...] = ()
    """ζ in [0, 1] of each setup now for dark clothing; None without figures of its sensors."""


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
    """Return the setups on the page as they are now."""
    each = (
        f"<b>{_text(n)}</b>: {counted(k, 'sensor')} on {counted(r, 'ring')}"
        for n, k, r in zip(names, sensors, rings, strict=True)
    )
    return _box(f"{'<br>'.join(each)} · robot {_text(robot)}")


def headline(
    zeta: float, target: str, what: str, where: str = "", dark: float | None = None
) -> str:
    """Return the coverage in large type, and what it means.

    Args:
        zeta: ζ in [0, 1].
        target: label of the target.
        what: sentence on what the target is, without its stop.
        where: of which setup, if there are several.
        dark: ζ in [0, 1] for dark clothing, if it is known.
    """
    also = "" if dark is None else f"; {100 * dark:.1f} % of dark clothing"
    return _box(
        f"<div style='font-size:21px;font-weight:600;line-height:1.3'>ζ = {100 * zeta:.1f} %"
        f" <span style='font-size:15px'>of {_text(target)} covered{_text(where)}{also}</span></div>"
        f"<span style='{_FAINT}'>{_text(what)}, less the robot itself. {IDEA}</span>"
    )


def zeta_table(names: Sequence[str], rows: Sequence[TableRow], seconds: str, poses: str) -> str:
    """Return a table of ζ of all targets, as opened and now, in percent.

    Args:
        names: of the setups.
        rows: coverage by target.
        seconds: how the estimate was made.
        poses: at which poses.
    """
    several = len(names) > 1
    head = ["ζ in %"]
    for name in names:
        head += [f"{name}, as opened", "now"] if several else ["as opened", "now"]
    cells = [[r.target, *(f"{100 * v:.1f}" for pair in r.values for v in pair)] for r in rows]
    if any(value is not None for r in rows for value in r.dark):
        head += [f"{name}, dark clothing" if several else "dark clothing" for name in names]
        for row, r in zip(cells, rows, strict=True):
            row += ["–" if value is None else f"{100 * value:.1f}" for value in r.dark]
    note = f"<span style='{_FAINT}'>estimated from points{_text(poses)}; {_text(seconds)}</span>"
    return _box(_table(head, cells) + note)


def legend(shares: Sequence[float], target: str, where: str, dark: bool = False) -> str:
    """Return the legend of the points.

    Args:
        shares: share of the target's points in each class.
        target: label of the target.
        where: setup and pose.
        dark: whether the page is dark.
    """
    rows = list(zip(KINDS, shares, strict=True))
    rows = [r for r in rows if r[0].covered][::-1] + [r for r in rows if not r[0].covered]
    edge = "box-shadow:0 0 0 1px rgba(128,128,128,.6)"
    ink = {k.number: f"background:{on_page(k.colour, dark)};{edge}" for k in KINDS}
    bar = "".join(f"<span style='{ink[k.number]};width:{100 * s:.2f}%'></span>" for k, s in rows)
    lines = "".join(
        f"<span><span style='{ink[k.number]};display:inline-block;width:10px;height:10px;"
        f"border-radius:5px'></span> {100 * s:.1f} % {_text(k.words)}</span>"
        for k, s in rows
    )
    return _box(
        f"Points of {_text(target)}{_text(where)}"
        f"<div style='display:flex;height:10px;margin:3px 0'>{bar}</div>"
        f"<div style='display:flex;flex-direction:column'>{lines}</div>"
    )


def sensor_text(report: SensorReport, name: str) -> str:
    """Return what one sensor does.

    Args:
        report: of the sensor.
        name: of its ring, or of itself.
    """
    blocked = ", ".join(f"{_text(n)} {100 * s:.2f} %" for n, s in report.blockers[:3])
    lines = [
        f"<b>Sensor {report.sensor} of {_text(name)}</b>",
        f"covers {100 * report.covered:.2f} % of the target; no other sensor covers"
        f" {100 * report.alone:.2f} %",
        f"blocked: {100 * report.blocked:.2f} %{f', by {blocked}' if blocked else ''}",
    ]
    return _box("<br>".join(lines))


def link(address: str) -> str:
    """Return a link to a state of the page."""
    return _box(
        f"<a href='{escape(printable(address), quote=True)}' target='_blank' rel='noopener'"
        " style='word-break:break-all'>Link to this state</a> (copy its address)"
    )


def proof_table(name: str, proofs: Sequence[Proof]) -> str:
    """Return a table of counts and guaranteed intervals."""
    rows = []
    for p in proofs:
        c, voxels = p.certified, p.counted
        of = "" if voxels.target_voxels is None else f"{voxels.target_voxels:,}"
        rows.append(
            [
                str(c.target),
                with_error(100 * voxels.zeta, voxels.error),
                of,
                percent(c, "certified"),
            ]
        )
    return _box(
        _text(name) + _table(["ζ in %", "counted", "target, cm³", "guaranteed interval"], rows)
    )


def sphere_legend(spheres: UnseenSpheres, dark: bool = False) -> str:
    """Return the legend of a map of unseen spheres; ``dark``: whether the page is dark."""
    step, kind = spheres.step, spheres.kind
    edge = "box-shadow:0 0 0 1px rgba(128,128,128,.6)"
    lines = []
    for k, colour in enumerate(SPHERES):
        share = spheres.unseen * float((kind == k).mean()) if len(kind) else 0.0
        last = k + 1 == len(SPHERES)
        size = f"{step * k} mm or more" if last else f"{step * k} to {step * (k + 1)} mm"
        lines.append(
            f"<span><span style='background:{on_page(colour, dark)};{edge};display:inline-block;"
            f"width:10px;height:10px;border-radius:5px'></span> ⌀ {size}"
            f" ({100 * share:.1f} %)</span>"
        )
    most_apart = float(np.ptp(spheres.diameters, axis=0).max(initial=0.0))
    largest = spheres.largest
    found = "none was found" if largest.centre is None else f"⌀ {largest.text}"
    return _box(
        f"<b>Unseen spheres</b> of {_text(str(spheres.target))}: the diameter of the largest one"
        " about each place that no sensor sees, and the share of such places"
        f"<div style='display:flex;flex-direction:column'>{''.join(lines)}</div>"
        f"<span style='color:{LARGEST}'>●</span> The largest: {_text(found)}, proved."
        f" <span style='{_FAINT}'>Elsewhere: the middle of bounds that are up to"
        f" {1000 * most_apart:.0f} mm apart.</span>"
    )


def note(text: str, bad: bool = False) -> str:
    """Return a line of plain text."""
    colour = WARNING if bad else "inherit"
    return _box(f"<span style='color:{colour}'>{_text(text)}</span>") if text else ""


def violations(texts: Sequence[str]) -> str:
    """Return why a setup cannot be built, in the colour of the rings concerned."""
    if not texts:
        return ""
    more = [f"and {len(texts) - _MOST_TOLD} more"] * (len(texts) > _MOST_TOLD)
    lines = "".join(f"<br>{_text(line)}" for line in (*texts[:_MOST_TOLD], *more))
    return _box(f"<span style='color:{WARNING}'><b>{UNBUILDABLE}:</b>{lines}</span>")


def paragraphs(lines: Sequence[str]) -> str:
    """Return lines of text, each in a paragraph of its own."""
    return _box("".join(f"<p>{_text(line)}</p>" for line in lines))
