"""Verdict of a report: whether a setup can be mounted, wired and powered, and covers what it must,
each with its figure."""

from collections.abc import Callable
from typing import Literal

from ...coverage.electronics.electronics import limit_text, unknown_reason
from ...formats.schema.written_models import VerdictModel
from ...objectives.feasibility.violations import ELECTRONICS
from ...objectives.object_bounds import Verdict
from ..lines.results import gap_verdict
from ..tables import target_label
from ..text import counted
from .cable_section import arm_power, wirings
from .facts import Facts, requirement_sentence

Question = Literal["mountable", "wireable", "powered", "covered"]
State = Verdict


def verdicts(f: Facts) -> tuple[VerdictModel, ...]:
    """Return the verdict on each question, with its figure or the reason as one line of text."""
    questions: dict[Question, Callable[[Facts], tuple[State, str]]] = {
        "mountable": _mountable,
        "wireable": _wireable,
        "powered": _powered,
        "covered": _covered,
    }
    each = ((name, *decided(f)) for name, decided in questions.items())
    return tuple(VerdictModel(question=q, state=state, figure=text) for q, state, text in each)


def overall(each: tuple[VerdictModel, ...]) -> str:
    """Return ``Passes.`` if all questions pass, ``Fails.`` if one fails, or ``Not decided.``"""
    states = {one.state for one in each}
    if "fail" in states:
        return "Fails."
    return "Not decided." if "not known" in states else "Passes."


def _mountable(f: Facts) -> tuple[State, str]:
    rings, broken = len(f.setup.rings), [x for x in f.broken if x.rule != ELECTRONICS]
    if broken:
        more = f" (and {len(broken) - 1} more)" if len(broken) > 1 else ""
        return "fail", f"{broken[0].text}{more}"
    if not f.scene.real:
        return "not known", "rings have no bodies in this scene"
    return "pass", f"{rings} of {counted(rings, 'ring')} keep to the scene's rules for real rings"


def _electrical(f: Facts) -> str:
    """Return why the setup has no electrical data; empty if it has."""
    texts = (unknown_reason(f.scene.electronics, group.sensor) for group in f.setup.groups)
    return next((text for text in texts if text), "")


def _wireable(f: Facts) -> tuple[State, str]:
    planned, _ = wirings(f.scene, f.setup)
    limits = [
        f"ring {i}: {text}"
        for i, one in enumerate(f.setup.groups)
        if (text := limit_text(f.scene.electronics, one.sensor, one.radius, one.count))
    ]
    if limits:
        return (
            "fail",
            f"{len(limits)} of {counted(len(planned), 'ring')} cannot be wired; {limits[0]}",
        )
    if reason := _electrical(f):
        return "not known", reason
    wired = [one for one in planned if one is not None]
    if not wired:
        return "not known", "there are no sensors"
    rates = sorted({one.rate_hz for one in wired})
    busy = max(one.bus.busy for one in wired)
    sent = sum(one.rate_hz * one.frame_bytes for one in wired)
    hertz = f"{rates[0]} Hz" if len(rates) == 1 else f"{rates[0]} to {rates[-1]} Hz"
    return "pass", (
        f"{len(wired)} of {counted(len(planned), 'ring')}, {hertz}, buses busy for at most"
        f" {100 * busy:.0f} % of the time, {sent} bytes a second"
    )


def _powered(f: Facts) -> tuple[State, str]:
    plan = arm_power(f.scene, f.setup)
    if reason := _electrical(f):
        return "not known", reason
    if plan is None:
        return "not known", "not all rings can be wired"
    return ("fail", plan.fault) if plan.fault else ("pass", plan.sentence)


def _covered(f: Facts) -> tuple[State, str]:
    stated: list[tuple[State, str]] = [
        ("pass" if one.passes else "fail", requirement_sentence(one)) for one in f.required
    ]
    stated += [
        (o.verdict, f"{target_label(r)}: {gap_verdict(o)}")
        for r in f.with_objects
        if (o := r.smallest_object) is not None and o.verdict is not None
    ]
    if stated:
        states = {state for state, _ in stated}
        worst = next(s for s in ("fail", "not known", "pass") if s in states)
        return worst, "; ".join(text for _, text in stated)
    counts = ", ".join(f"{target_label(r)}: {100 * r.zeta:.2f} %" for r in f.own)
    how = "state one as --require V_S:0.5=90"
    return "not known", f"no requirement is stated ({how}); counted: {counts}"
