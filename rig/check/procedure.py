"""The steps of a check: where the robot stands, where the rod is placed, and when readings count.

Readings are collected all the time. Notes in the session, and so in the recording, tell which
readings belong to which step.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..mount.stop_plan import MountPlan
from ..rod.trial_plan import RodPlan
from ..session.retention import LONGEST
from ..session.session import Session
from .options import Part
from .plans import Plans

_SLOWEST = 5.0  # frames a second, the slowest ring that is waited for
_PATIENCE = 1.0  # s, in addition
_LOOK = 0.02  # s
_NO_WAY = "no way that keeps its distances leads there"
_BY_PERSON = "skipped by the person at the rig"


class EndedError(Exception):
    """The check cannot continue, or was ended; the text says why. The data collected so far is
    still assessed.
    """


@dataclass(frozen=True)
class Operator:
    """Brings the robot to its poses and the rod to its points. What is skipped returns False; all
    raise EndedError if the check must end."""

    order: Callable[[Float[np.ndarray, "P J"]], Sequence[int]]
    """The indices of the reachable poses among P, in the order to visit them."""
    stand: Callable[[Float[np.ndarray, " J"], str], bool]
    """Bring the robot to joints (J,) rad, which a text names, and let it stand still."""
    put: Callable[[Float[np.ndarray, " 3"] | None, str], bool]
    """Put the rod's centre at a point (3,) m, which a text names, or take the rod away."""
    wave: Callable[[int], bool]
    """Pass a hand over the sensors of a ring, one by one."""
    show: Callable[[Part, int, int], None]
    """Show how many of how many steps of a part are complete."""


class Span(NamedTuple):
    """Period of one step."""

    what: str
    """``self``, ``wave`` (at a ring), ``mount`` (at a stop), ``before`` (at a pose without the rod)
    or ``trial`` (with it).
    """
    number: int
    """Number of the ring, stop, pose or trial."""
    begin: float
    """Start, s of the host's monotonic clock."""
    end: float
    """End, s of the host's monotonic clock."""


def spans(said: Iterable[tuple[float, dict[str, Any]]]) -> list[Span]:
    """Return the completed steps from the notes of a session; steps without an end are omitted."""
    done, begun = list[Span](), None
    for at, words in said:
        match words:
            case {"what": "begin", "step": str(step), "number": int(number)}:
                begun = (step, number, at)
            case {
                "what": "step",
                "step": str(step),
                "number": int(number),
                "begin": float(begin),
                "end": float(end),
            }:
                done.append(Span(step, number, begin, end))
            case {"what": "end"} if begun:
                done.append(Span(*begun, at))
                begun = None
    return done


def skipped(said: Iterable[tuple[float, dict[str, Any]]], step: str) -> dict[int, str]:
    """Return why each skipped step was skipped, by its number, from the notes of a session."""
    found: dict[int, str] = {}
    for _, words in said:
        match words:
            case {"what": "skipped", "step": str(what), "number": int(number), "why": str(why)}:
                if what == step:
                    found[number] = why
    return found


def unfinished(said: Sequence[tuple[float, dict[str, Any]]], step: str) -> float | None:
    """Return when the last step ``step`` began, s, if it never ended; else None."""
    begun: float | None = None
    for at, words in said:
        if words.get("what") in ("begin", "end"):
            begun = at if words.get("step") == step and words["what"] == "begin" else None
    return begun


def run(
    session: Session,
    plans: Plans,
    operator: Operator,
    before_poses: Callable[[], None] = lambda: None,
    repeats: Sequence[int] = (),
) -> str:
    """Run all plans; return why they ended early, or an empty string.

    Args:
        session: robot and rings.
        plans: what to do.
        operator: who does it.
        before_poses: called after the self check, before the robot leaves its place; raises
            EndedError if it must not.
        repeats: number of frames of each ring that hold one reading of a sensor; none: one.

    Ctrl-C ends the check like any other reason; so does a signal that is raised as a
    KeyboardInterrupt, whose text is the reason.
    """
    why = ""
    try:
        if plans.seconds is not None:
            _self(session, plans.seconds, operator)
        if plans.wave:
            _wave(session, operator)
        before_poses()
        if plans.mount is not None:
            _mount(session, plans.mount, operator, repeats)
        if plans.rods:
            _rod(session, plans.rods, operator, repeats)
    except EndedError as error:
        why = str(error)
    except KeyboardInterrupt as error:
        why = str(error) or "interrupted"
    session.say("ended", why=why)
    return why


def _self(session: Session, seconds: float, operator: Operator) -> None:
    if seconds > LONGEST:
        text = f"of the self check's {seconds:g} s, only the last {LONGEST:g} s are assessed"
        session.say("warning", text=text)
    session.say("begin", step="self", number=0)
    begin = time.monotonic()
    while (spent := time.monotonic() - begin) < seconds:
        operator.show("self", int(spent), int(np.ceil(seconds)))
        _check(session)
        time.sleep(_LOOK)
    session.say("end")


def _wave(session: Session, operator: Operator) -> None:
    rings = len(session.rings.counts)
    for ring in range(rings):
        operator.show("self", ring, rings)
        _check(session)
        session.say("begin", step="wave", number=ring)
        if operator.wave(ring):
            session.say("end")


def _mount(session: Session, plan: MountPlan, operator: Operator, repeats: Sequence[int]) -> None:
    order = operator.order(plan.joints)
    _skip(session, "mount", set(range(len(plan.joints))) - set(order), _NO_WAY)
    for done, stop in enumerate(order):
        operator.show("mount", done, len(order))
        if operator.stand(plan.joints[stop], f"stop {stop} of the mount check"):
            _read(session, plan.frames, "mount", stop, repeats)
        else:
            _skip(session, "mount", {stop}, _BY_PERSON)
    operator.show("mount", len(order), len(order))


def _skip(session: Session, step: str, numbers: set[int], why: str) -> None:
    """Note why steps are skipped."""
    for number in sorted(numbers):
        session.say("skipped", step=step, number=int(number), why=why)


def _rod(
    session: Session, plans: Sequence[RodPlan], operator: Operator, repeats: Sequence[int]
) -> None:
    joints, before = plans[0].joints, plans[0].detection.before
    first = np.cumsum([0, *(len(p.stratum) for p in plans)])
    done, total = 0, int(first[-1])
    order = operator.order(joints)
    _skip(session, "pose", set(range(len(joints))) - set(order), _NO_WAY)
    for pose in order:
        there = operator.stand(joints[pose], f"pose {pose} of the coverage check")
        if there and operator.put(None, f"pose {pose}: no rod, nobody in the sensors' reach"):
            _read(session, before, "before", pose, repeats)
            for plan, start in zip(plans, first[:-1], strict=True):
                for trial in np.flatnonzero(plan.pose == pose):
                    operator.show("coverage", done, total)
                    x, y, z = 1000 * plan.point[trial]
                    words = (
                        f"trial {start + trial}: rod upright, its centre at ({x:.0f}, {y:.0f},"
                        f" {z:.0f}) mm"
                    )
                    if operator.put(plan.point[trial], words):
                        wanted, number = plan.detection.frames, int(start + trial)
                        _read(session, wanted, "trial", number, repeats)
                    done += 1
        if there:
            operator.put(None, f"pose {pose} is done: rod away")
        else:
            _skip(session, "pose", {pose}, _BY_PERSON)
    operator.show("coverage", done, total)


def _read(session: Session, frames: int, step: str, number: int, repeats: Sequence[int]) -> None:
    """Wait for ``frames`` frames of every ring with new readings, not counting the one that was
    already under way.
    """
    session.say("begin", step=step, number=int(number))
    first = [c.frames for c in session.rings.counts]
    each = [frames * n for n in repeats or [1] * len(first)]
    until = time.monotonic() + _most_s(max(each, default=frames)) * session.patience
    while time.monotonic() < until:
        _check(session)
        counts = [c.frames for c in session.rings.counts]
        if all(now - f > n for now, f, n in zip(counts, first, each, strict=True)):
            break
        time.sleep(_LOOK)
    session.say("end")


def _most_s(frames: int) -> float:
    """Return how long to wait for as many frames, s."""
    return (frames + 1) / _SLOWEST + _PATIENCE


def _check(session: Session) -> None:
    if session.trouble:
        raise EndedError(session.trouble)
