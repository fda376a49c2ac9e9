"""The dossier as Markdown: on the first page what it does not prove and the state of each input."""

from collections.abc import Iterator
from typing import get_args

from ...simulation.dossier.dossier import Dossier
from ...simulation.dossier.records import Element, Input, State
from ..pages import command_of, escaped, table
from ..text import counted, listed
from .capability_section import capability_section
from .sections import distance_section, floor_section, stop_section

PICTURE = "floor.png"


def heading(d: Dossier) -> str:
    """Return the title, as plain text."""
    return f"Safety dossier of {d.stated.cell or d.setup} ({d.robot})"


def page(d: Dossier, command: str, version: str, created: str) -> str:
    """Return the dossier.

    Args:
        d: the dossier.
        command: the call or the command that wrote it.
        version: version of place-rings.
        created: date and time.
    """
    parts = (
        _cover(d, version, created),
        _inputs(d),
        distance_section(d),
        stop_section(d),
        _reaction(d),
        capability_section(d),
        floor_section(d, PICTURE),
        _elements(d),
        _origin(command),
    )
    return "\n".join(line for part in parts for line in part) + "\n"


def _cover(d: Dossier, version: str, created: str) -> Iterator[str]:
    yield f"# {escaped(heading(d))}\n"
    yield f"> {d.disclaimer}\n"
    yield "## What this dossier does not prove\n"
    for line in d.does_not_prove:
        what, _, why = line.partition(". ")
        yield f"- **{escaped(what)}.** {escaped(why)}"
    yield "\n### State of the inputs\n"
    rows = []
    for state in get_args(State):
        names = [escaped(_named(one)) for one in d.inputs if one.state == state]
        names += [escaped(f"{e.element} (level)") for e in d.elements if e.state == state]
        open_levels = sum(e.default_state == state for e in d.elements)
        names += [f"{counted(open_levels, 'default performance level')}"] if open_levels else []
        rows.append((f"**{state}**", "; ".join(names) or "none"))
    yield table(("state", "inputs"), rows)
    yield (
        f"Setup {escaped(d.setup)}, robot {escaped(d.robot)}. Responsible:"
        f" {_or_open(d.stated.author)}. Risk assessment: {_or_open(d.stated.risk_assessment)}."
        f" Safety function: {_or_open(d.stated.safety_function)}. Written {created} by place-rings"
        f" {escaped(version)}.\n"
    )
    yield "---\n"


def _or_open(text: str) -> str:
    return f"{escaped(text)} (stated by the user)" if text else "**open**"


def _named(one: Input) -> str:
    return f"{one.name} {one.symbol}".strip()


def _inputs(d: Dossier) -> Iterator[str]:
    yield "## Inputs\n"
    yield "Every later figure follows from these values.\n"
    rows = [
        (*map(escaped, (one.name, one.symbol)), _value(one), _state(one.state), escaped(one.source))
        for one in d.inputs
    ]
    yield table(("input", "symbol", "value", "state", "source"), rows)


def _value(one: Input) -> str:
    if one.value is None:
        return escaped(one.text) or "**open**"
    return f"{one.value:.4g}\u00a0{one.unit}"


def _state(state: State) -> str:
    return f"**{state}**" if state in ("open", "assumed") else state


def _reaction(d: Dossier) -> Iterator[str]:
    r, by_name = d.simulation, {one.name: one for one in d.inputs}
    period = by_name["period of the readings"]
    latency = by_name["latency from a reading to its report"]
    yield "## Reaction time\n"
    yield (
        f"A person who enters a beam and stays is reported after at most"
        f" {1000 * (r.period_s + r.latency_s):.0f} ms: a period of {1000 * r.period_s:.0f} ms"
        f" ({period.state}: {escaped(period.source)}) and a latency of"
        f" {1000 * r.latency_s:.0f} ms ({latency.state}: {escaped(latency.source)}). T_r ="
        f" {r.separation.reaction_s:g} s in the separation distances contains both. Measured on the"
        f" rig: {_or_open(d.stated.reaction_time)}.\n"
    )
    if not r.scheduled:
        yield (
            "**Sensors that fire together may disturb each other, which this period leaves out.**"
            " With `--scheduled` it is that of the firing schedule.\n"
        )


def _elements(d: Dossier) -> Iterator[str]:
    yield "## Performance level of each element\n"
    yield (
        "ISO 10218-2:2025 gives each safety function its own default performance level, in place of"
        " PL d with Category 3 for all. Its table was not to hand, so defaults are open until the"
        " user states them (`--facts`).\n"
    )
    rows = [
        (escaped(e.element), _or_open(e.default), _rating(e), escaped(e.source) or "none")
        for e in d.elements
    ]
    yield table(("element", "default level", "rating", "source"), rows)
    unrated = [escaped(e.element) for e in d.elements if e.state == "open"]
    if unrated:
        yield f"No rating is known for: {listed(unrated)}.\n"


def _rating(e: Element) -> str:
    if e.state == "open":
        return f"**open**: {escaped(e.rating)}"
    return f"{escaped(e.rating)} ({e.state})"


def _origin(command: str) -> Iterator[str]:
    yield "## Reproduce\n"
    yield "`dossier.json` has the same figures. Both were written by:\n"
    yield command_of(command)
