"""The inputs of a dossier: each value with its unit, state and source."""

from collections.abc import Iterator

from ...coverage.electronics.electronics import unknown_reason
from ...coverage.person_reach import SHOULDER, Person
from ...coverage.rings.ring import Setup
from ...coverage.rings.sensor_records import sensor_records
from ...coverage.robots.separation_distance import (
    LEAST_DISTANCE,
    PARALLEL,
    STOPPING,
    UPPER_LIMB,
    WALKING,
    Safety,
)
from ...objectives.scene import Scene
from ..safety import SafetyResult
from ..safety_options import SafetyOptions
from .capability import Capability
from .records import Input, State
from .statements import Statements

_EXAMPLE = "worked example in the literature, as quoted by secondary sources; not of this cell"
_13855 = "ISO 13855, by secondary sources"
_LAW = "law between the makers' figures, not measured"
_SCENE = "[safety] of the scene"
_DEFAULTS = Safety()


def inputs_of(
    setup: Setup,
    scene: Scene,
    options: SafetyOptions,
    r: SafetyResult,
    capability: Capability,
    stated: Statements,
) -> tuple[Input, ...]:
    """Return all inputs of a dossier.

    Args:
        setup: the setup.
        scene: its scene.
        options: options of the simulation.
        r: result of the simulation.
        capability: what the sensors can detect.
        stated: what the user states.
    """
    return (
        *_speeds(scene, r),
        *_times(setup, scene, options, r, stated),
        *_lengths(scene),
        *_ranges(setup),
        *_detection(scene, stated),
        *_objects(capability),
        *_shares(capability),
    )


def _speeds(scene: Scene, r: SafetyResult) -> Iterator[Input]:
    for name, value in (("walking", WALKING), ("upper limb", UPPER_LIMB)):
        yield Input(
            name=f"approach speed, {name}",
            symbol="K",
            value=value,
            unit="m/s",
            state="standard",
            source=_13855,
        )
    own = scene.safety.human == WALKING
    yield Input(
        name="speed of the simulated person",
        symbol="v_h",
        value=scene.safety.human,
        unit="m/s",
        state="standard" if own else "stated by the user",
        source=f"{_13855}: walking" if own else f"{_SCENE}, human_speed",
    )
    if r.separation.speeds_known:
        state: State = "computed"
        source = "joint speeds of the motion; upper bound over the parts of the robot"
    elif scene.safety.speed == _DEFAULTS.speed:
        state, source = "assumed", "no joint speeds are known: the robot counts as standing still"
    else:
        state, source = "stated by the user", f"{_SCENE}, robot_speed, for all parts"
    yield Input(
        name="speed of the robot's fastest part",
        symbol="v_r",
        value=r.separation.fastest_m_s,
        unit="m/s",
        state=state,
        source=source,
    )


def _times(
    setup: Setup, scene: Scene, options: SafetyOptions, r: SafetyResult, stated: Statements
) -> Iterator[Input]:
    late = r.period_s + r.latency_s
    longer = scene.safety.reaction < late
    state, source = _stated(scene.safety.reaction, _DEFAULTS.reaction, "reaction_s")
    yield Input(
        name="reaction time",
        symbol="T_r",
        value=r.separation.reaction_s,
        unit="s",
        state="computed" if longer else state,
        source=f"period plus latency, longer than reaction_s = {scene.safety.reaction:g} s"
        if longer
        else source,
    )
    yield _period(setup, scene, options, r)
    own = options.latency == SafetyOptions().latency
    yield Input(
        name="latency from a reading to its report",
        value=r.latency_s,
        unit="s",
        state="assumed" if own else "stated by the user",
        source="default of place-rings, not measured" if own else "--latency",
    )
    yield _text("reaction time measured on the rig", stated.reaction_time)
    state, source = _stopping(scene, r)
    yield Input(
        name="stopping time",
        symbol="T_s",
        value=r.separation.stopping_s,
        unit="s",
        state=state,
        source=source,
    )


def _period(setup: Setup, scene: Scene, options: SafetyOptions, r: SafetyResult) -> Input:
    state: State = "computed"
    source = "bus, driver and rate of each ring; the slowest ring"
    if options.rate is not None:
        state, source = "stated by the user", "--rate"
    elif r.scheduled:
        source = "firing schedule without mutual interference, with the bus; the slowest ring"
    elif r.rate_assumed:
        state, source = "assumed", "20 readings per second: no rate is known"
    elif any(unknown_reason(scene.electronics, group.sensor) for group in setup.groups):
        state, source = "maker's", "highest rate of the sensor's mode; no limit of a bus is known"
    return Input(
        name="period of the readings", value=r.period_s, unit="s", state=state, source=source
    )


def _stopping(scene: Scene, r: SafetyResult) -> tuple[State, str]:
    if r.stops:
        count = sum(row.measurements for row in r.stops)
        few = sum(not row.enough for row in r.stops)
        doubt = f"; {few} of {len(r.stops)} conditions have fewer than 10" if few else ""
        return "measured by the user", f"largest of {count} measured stops{doubt}"
    if scene.safety.stopping is not None:
        return "stated by the user", f"{_SCENE}, stopping_s"
    if scene.robot.name in STOPPING:
        return "maker's", "UR10 CB3 manual, section 1.6.2, at the next higher speed limit"
    return "open", "none"


def _lengths(scene: Scene) -> Iterator[Input]:
    for name, symbol, field in (
        ("intrusion distance, also taken as D_DS", "C", "intrusion"),
        ("uncertainty of the person's position", "Z_d", "sensor"),
        ("uncertainty of the robot's position", "Z_r", "robot"),
    ):
        key = {"intrusion": "intrusion_m"}.get(field, f"{field}_uncertainty_m")
        value: float = getattr(scene.safety, field)
        state, source = _stated(value, getattr(_DEFAULTS, field), key)
        yield Input(name=name, symbol=symbol, value=value, unit="m", state=state, source=source)
    for name, symbol, value in (
        ("reaching distance, approach parallel to the zone", "D_DS", PARALLEL),
        ("least separation distance", "S", LEAST_DISTANCE),
    ):
        yield Input(
            name=name,
            symbol=symbol,
            value=value,
            unit="m",
            state="standard",
            source="ISO 13855:2024, by secondary sources",
        )


def _stated(value: float, default: float, key: str) -> tuple[State, str]:
    if value == default:
        return "default", _EXAMPLE
    return "stated by the user", f"{_SCENE}, {key}"


def _ranges(setup: Setup) -> Iterator[Input]:
    for one in sensor_records(setup):
        light = "light not stated: best case" if one.ambient is None else f"light {one.ambient}"
        cloth = (
            "reflectance not stated: best case"
            if one.reflectance is None
            else f"reflectance {100 * one.reflectance:g} %"
        )
        laws = not all(rule.measured for rule in one.rules)
        yield Input(
            name=f"range of {one.title} ({light}, {cloth})",
            value=one.range_m,
            unit="m",
            state="computed" if laws else "maker's",
            source=f"{one.source}{'; reduced by laws, see its derivation' if laws else ''}",
        )
    nominal = {g.sensor.range_m for g in setup.groups if g.sensor.use is None}
    for range_m in sorted(nominal):
        yield Input(
            name="nominal range of a sensor that is not in the catalogue",
            value=range_m,
            unit="m",
            state="assumed",
            source="the setup states it for any target and light",
        )


def _detection(scene: Scene, stated: Statements) -> Iterator[Input]:
    yield _text(
        "effective detection capability d_e, verified with its test piece",
        stated.detection_capability,
    )
    person = scene.person or Person()
    own = scene.person is None
    yield Input(
        name="stature of the smallest person on the floor",
        value=person.shoulder / SHOULDER,
        unit="m",
        state="default" if own else "stated by the user",
        source="shoulders at 1.2 m; a default of place-rings" if own else "[person] of the scene",
    )
    yield _text("measures against undetected access and presence", stated.rear_access)


def _objects(c: Capability) -> Iterator[Input]:
    """Yield the bounds of the largest unseen objects, or that they are open."""
    each = [(t.target, t.objects) for t in c.targets if t.objects is not None]
    for target, o in each:
        rod = f"vertical rod of {o.rod_length:g} m"
        for shape, bounds in (("sphere", o.sphere), (rod, o.rod)):
            yield Input(
                name=f"largest {shape} that no sensor sees, centre in {target}",
                symbol="d_e" if shape == "sphere" else "",
                text=f"⌀ {bounds.text}",
                state="computed",
                source=f"geometry of the nominal beams, both ends proved; {_moments(c)}",
            )
    if not each:
        yield Input(
            name="largest object that no sensor sees",
            symbol="d_e",
            state="open",
            source="--smallest-object bounds it",
        )


def _shares(c: Capability) -> Iterator[Input]:
    """Yield the expected shares with detection, or that they are open."""
    each = [(t.target, t.detection, t.proved) for t in c.targets]
    for target, d, proved in each:
        if d is None or proved is None or proved.low is None or proved.high is None:
            continue
        own = d.question.rates is not None
        low, high = 100 * (d.assumed_low or 0.0), 100 * (d.assumed_high or 0.0)
        yield Input(
            name=f"expected share of {target} in which {d.question.piece.name} is detected",
            text=f"{100 * d.zeta:.2f} ± {100 * (d.error or 0.0):.2f} %; {low:.2f} to {high:.2f} %"
            f" by the assumptions; proved value of the law: {100 * proved.low:.1f} to"
            f" {100 * proved.high:.1f} %",
            state="computed",
            source=f"{'rates that the user measured' if own else _LAW}; {_moments(c)}",
        )
    if all(d is None for _, d, _ in each):
        yield Input(
            name="expected share in which a test piece is detected",
            state="open",
            source="--detect computes it",
        )


def _moments(c: Capability) -> str:
    return f"{c.moments} of {c.of_moments} moments"


def _text(name: str, text: str) -> Input:
    return Input(
        name=name,
        text=text,
        state="stated by the user" if text else "open",
        source="statements of the user" if text else "none",
    )
